// The slow twin of the rasteriser: every Gaussian on every pixel, in double, straight from the
// formulas, without tiles, boxes or vectors.
#pragma once

#include <vector>

#include "covsplat/core/se3.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/gaussians.hpp"
#include "covsplat/splat/splat_config.hpp"

namespace covsplat {

/// A Gaussian that a ray met.
struct RayHit {
  double weight = 0.0;
  double range = 0.0;
};

struct PixelSums {
  double transmittance = 1.0;
  double range_sum = 0.0;
  double median = 0.0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  std::vector<RayHit> hits;  ///< front to back
};

/// Blends all Gaussians of a table (anchored at `T_sensor_anchor`) along the ray of one pixel.
PixelSums BlendPixel(const SensorModel& sensor,
                     const RasterConfig& config,
                     const GaussianColumns<double>& gaussians,
                     const SE3& T_sensor_anchor,
                     int row,
                     int column);

}  // namespace covsplat
