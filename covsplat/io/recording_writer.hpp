// RecordingWriter: writes a recording in the layout that OpenScanSource reads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/core/triangle_mesh.hpp"
#include "covsplat/io/output_file.hpp"

namespace covsplat {

/// Writes velodyne/NNNNNN.bin, timestamps/NNNNNN.bin (where points have times), labels/NNNNNN.label
/// (where they have labels), times.txt and poses.txt scan by scan, and gt_tum.txt at the end. If
/// the process is killed, what lies there lacks at most the lines of the last scan.
class RecordingWriter {
 public:
  /// Creates the folder. One that is not empty is an error unless `overwrite`. That replaces a
  /// recording that was written here before, known by its marker file; it never removes anything
  /// else, and refuses a folder that holds other scans.
  static Result<RecordingWriter> Create(const std::filesystem::path& folder, bool overwrite);

  /// `T_world_sensor` is the pose at the stamp of the scan. Either all scans with points have times
  /// of points or none, and likewise labels.
  Result<void> Write(const Scan& scan, const SE3& T_world_sensor);

  /// gt_mesh.ply: the surfaces that were there, in the frame of the poses.
  Result<void> WriteMesh(const TriangleMesh& mesh);
  /// sensor.yaml: the section `sensor` of a configuration for runs on this recording.
  Result<void> WriteSensor(std::string_view yaml);

  /// Writes the true trajectory and closes the files.
  Result<void> Finish(const Trajectory& dense_truth);

 private:
  // A folder with one value per point, if points have such values: not known before the first scan
  // with points.
  struct Column {
    const char* folder;
    const char* extension;
    std::optional<bool> present;
  };
  Result<void> WriteColumn(Column& column,
                           const Scan& scan,
                           std::int64_t index,
                           std::size_t values,
                           std::string_view bytes);
  RecordingWriter(std::filesystem::path folder, AppendFile times, AppendFile poses)
      : folder_(std::move(folder)), times_(std::move(times)), poses_(std::move(poses)) {}

  std::filesystem::path folder_;
  AppendFile times_;
  AppendFile poses_;
  std::int64_t count_ = 0;
  Column times_of_points_{"timestamps", ".bin", {}};
  Column labels_{"labels", ".label", {}};
};

}  // namespace covsplat
