// DepthView: the map rendered from one pose, ready to be fused.
#pragma once

#include <vector>

#include "covsplat/core/image.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/mesh/mesh_config.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// A spherical image with square pixels, as ViewConfig asks for; the rasteriser's convention of
/// pixels, with a fast projection.
class ViewCamera {
 public:
  explicit ViewCamera(const ViewConfig& config);

  /// What the map is rendered with, out to `max_range_m` (the reach of the sensor that made it).
  SensorModel Sensor(double min_range_m, double max_range_m) const;
  int Rows() const { return rows_; }
  int Columns() const { return columns_; }

  /// Index of the pixel (row * Columns() + column) that a point in the view's frame falls on, or
  /// -1 outside the image; `range_m` is its distance.
  int Project(const Eigen::Vector3f& point, float range_m) const;
  Eigen::Vector3f RayOf(int row, int column) const;

 private:
  int rows_;
  int columns_;
  double top_rad_;     ///< elevation of the centres of row 0
  double bottom_rad_;  ///< and of the last row
  float max_range_m_;
  float rows_per_rad_;
  float columns_per_rad_;
};

/// A plane through the surface that a pixel shows, and how far the pixel can be trusted.
struct DepthPixel {
  float range_m = 0.0f;                              ///< along the pixel's ray; 0: not known
  float weight = 0.0f;                               ///< at most 1
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, view frame, facing the view
};

struct DepthView {
  SE3 T_map_view;
  Image<DepthPixel> pixels;
};

/// Keeps of a rendering what is opaque enough. Where expected and median range disagree, and next
/// to jumps in range, the median is taken with little weight.
DepthView MakeDepthView(const ViewCamera& camera,
                        const RenderOutput& render,
                        const SE3& T_map_view,
                        const ViewConfig& config,
                        ThreadPool& pool);

}  // namespace covsplat
