// Scan: what a LiDAR delivers for one turn or one frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace covsplat {

/// Points in the sensor frame (x forward, y left, z up), in metres, each as measured from where the
/// sensor was at that point's own time: nothing is deskewed yet. Optional columns are either empty
/// or as long as `points`.
struct Scan {
  std::int64_t index = 0;               ///< number of the scan in its recording
  double stamp_s = 0.0;                 ///< reference time; `time_offset_s` counts from it
  std::vector<Eigen::Vector3f> points;  ///< [N] m
  std::vector<float> intensity;         ///< [N] or empty; the recording's own unit
  std::vector<float> time_offset_s;     ///< [N] or empty: time of the point - stamp_s
  std::vector<std::uint32_t> label;     ///< [N] or empty; class, numbered as in SemanticKITTI
  std::string source;                   ///< file it came from, for messages
};

}  // namespace covsplat
