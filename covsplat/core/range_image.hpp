// RangeImage: a scan seen through its sensor model.
#pragma once

#include <span>

#include <Eigen/Core>

#include "covsplat/core/image.hpp"
#include "covsplat/core/sensor_model.hpp"

namespace covsplat {

/// Pixels without a return have range 0 and index -1.
struct RangeImage {
  Image<float> range_m;
  Image<int> point_index;  ///< which of the projected points the pixel shows
};

/// Nearest point per pixel, the lower index among equals; points outside the sensor's range limits
/// or view, or not finite, are left out. `points` are in the sensor frame.
RangeImage ProjectScan(const SensorModel& sensor, std::span<const Eigen::Vector3f> points);

}  // namespace covsplat
