// Trajectories as text: TUM (`stamp x y z qx qy qz qw`), KITTI (12 numbers of a 3x4 matrix), and
// what trajectory_csv.hpp reads.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/core/trajectory.hpp"

namespace covsplat {

/// `x y z qx qy qz qw`, exact.
std::string PoseText(const SE3& pose);
/// Of these seven numbers; nothing if there are not seven, one is not finite, or the quaternion is
/// not of unit length (to 1 %; it is normalised).
std::optional<SE3> ParsePose(std::span<const double> numbers);

/// One line with its end, for files that grow. Numbers but the stamp (nanoseconds) are exact.
std::string TumLine(const TimedPose& pose);
std::string KittiLine(const SE3& pose);

Result<void> WriteTum(const std::filesystem::path& path, const Trajectory& trajectory);
Result<void> WriteKittiPoses(const std::filesystem::path& path, const Trajectory& trajectory);

/// Times must increase and quaternions be unit length (to 1 %, and are normalised). Blank lines and
/// lines that start with '#' are passed over. Errors name the line.
Result<Trajectory> ReadTum(const std::filesystem::path& path);
/// One pose per line.
Result<std::vector<SE3>> ReadKittiPoses(const std::filesystem::path& path);

/// One number per line, as in the times.txt of a recording; not decreasing.
Result<std::vector<double>> ReadStamps(const std::filesystem::path& path);

enum class TrajectoryFormat { kTum, kKitti, kEuroc, kNewerCollege };

/// Told by the commas and the number of columns of the first row of numbers.
Result<TrajectoryFormat> DetectTrajectoryFormat(const std::filesystem::path& path);

/// In any of the formats. The lines of a KITTI file belong to `stamps_s`, one to one; others have
/// their own times.
Result<Trajectory> LoadTrajectory(const std::filesystem::path& path,
                                  std::span<const double> stamps_s);

/// Poses and stamps become a trajectory; an error that names `path` if their numbers differ.
Result<Trajectory> WithStamps(const std::vector<SE3>& poses,
                              std::span<const double> stamps_s,
                              const std::filesystem::path& path);

/// From 12 numbers, row by row; nothing if they are not finite or no rotation and translation.
std::optional<SE3> PoseOfMatrix(std::span<const double> numbers);

}  // namespace covsplat
