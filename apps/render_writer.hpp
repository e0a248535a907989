// RenderWriter: renderings of a map as images and as a recording of simulated scans.
#pragma once

#include <filesystem>

#include "covsplat/core/sensor_model.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/io/recording_writer.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// Steps per metre of the range images.
inline constexpr double kRangeImageScale = 256.0;

/// Writes range/NNNNNN.png (16 bits, steps of 1/256 m, 0 where nothing is), normal/NNNNNN.png
/// (sensor frame, -1..1 as 0..255) and opacity/NNNNNN.png (0..1 as 0..255), and the scans that the
/// sensor would take standing still: velodyne/NNNNNN.bin with times.txt, poses.txt and
/// groundtruth_tum.txt. The fourth number of a point is the opacity it was rendered with.
class RenderWriter {
 public:
  /// Creates the folder; one that is not empty is an error unless `overwrite`, which replaces what
  /// was rendered here before.
  static Result<RenderWriter> Create(const std::filesystem::path& folder, bool overwrite);

  /// Pixels below `min_alpha`, or outside the sensor's range, have no range and no point.
  Result<void> Write(const SensorModel& sensor,
                     const RenderOutput& render,
                     const TimedPose& pose,
                     double min_alpha);
  Result<void> Finish();

 private:
  RenderWriter(std::filesystem::path folder, RecordingWriter recording)
      : folder_(std::move(folder)), recording_(std::move(recording)) {}

  std::filesystem::path folder_;
  RecordingWriter recording_;
  Trajectory poses_;
};

}  // namespace covsplat
