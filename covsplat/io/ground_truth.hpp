// The ground truth that lies with a recording.
#pragma once

#include <filesystem>
#include <optional>

#include "covsplat/core/result.hpp"
#include "covsplat/core/trajectory.hpp"

namespace covsplat {

struct GroundTruth {
  std::filesystem::path path;
  Trajectory trajectory;  ///< of the LiDAR, in the clock of the recording
};

/// Looks, in this order, for
///  - `gt_tum.txt`: the sensor's pose at any times,
///  - `poses.txt`: its 3x4 poses at the times of times.txt,
///  - `../../poses/NN.txt` of a KITTI odometry folder `sequences/NN`: poses of the left camera,
///    turned into those of the LiDAR with the `Tr` of calib.txt.
/// Without times.txt scans are `scan_period_s` apart. Nothing if there is none of these.
Result<std::optional<GroundTruth>> FindGroundTruth(const std::filesystem::path& recording,
                                                   double scan_period_s = 0.1);

/// The last of these, from a given file of poses, whatever else lies with the recording
/// (SemanticKITTI puts a poses.txt of an estimate there).
Result<Trajectory> ReadOdometryTruth(const std::filesystem::path& poses,
                                     const std::filesystem::path& recording,
                                     double scan_period_s = 0.1);

}  // namespace covsplat
