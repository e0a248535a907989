// RecordingWriter: writes a recording in the layout that OpenScanSource reads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/io/output_file.hpp"

namespace covsplat {

/// Writes velodyne/NNNNNN.bin, timestamps/NNNNNN.bin (where points have times), times.txt and
/// poses.txt scan by scan, and groundtruth_tum.txt at the end. If the process is killed, what lies
/// there lacks at most the lines of the last scan.
class RecordingWriter {
 public:
  /// Creates the folder. One that is not empty is an error unless `overwrite`. That replaces a
  /// recording that was written here before, known by its marker file; it never removes anything
  /// else, and refuses a folder that holds other scans.
  static Result<RecordingWriter> Create(const std::filesystem::path& folder, bool overwrite);

  /// `T_world_sensor` is the pose at the stamp of the scan. Either all scans with points have times
  /// of points or none.
  Result<void> Write(const Scan& scan, const SE3& T_world_sensor);

  /// Writes the true trajectory and closes the files.
  Result<void> Finish(const Trajectory& dense_truth);

 private:
  Result<void> WritePointTimes(const Scan& scan, std::int64_t index);
  RecordingWriter(std::filesystem::path folder, AppendFile times, AppendFile poses)
      : folder_(std::move(folder)), times_(std::move(times)), poses_(std::move(poses)) {}

  std::filesystem::path folder_;
  AppendFile times_;
  AppendFile poses_;
  std::int64_t count_ = 0;
  std::optional<bool> has_point_times_;  // not known before the first scan with points
};

}  // namespace covsplat
