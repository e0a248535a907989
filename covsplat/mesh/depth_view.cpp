#include "covsplat/mesh/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
/// Of pixels that mix surfaces.
constexpr float kMixedWeight = 0.1f;
/// Surfaces that are met flatter than this are not known.
constexpr float kMinCosine = 0.05f;

/// Arc tangent on [0, 1] by an odd polynomial, fitted to 2e-6 rad.
float ArcTangent(float x) {
  const float s = x * x;
  constexpr float kC[] = {
      0.99997722f, -0.33262283f, 0.19354039f, -0.11642649f, 0.05264734f, -0.01171913f};
  return x * (kC[0] + s * (kC[1] + s * (kC[2] + s * (kC[3] + s * (kC[4] + s * kC[5])))));
}

/// std::atan2 to 2e-6 rad: projections into voxels are the time of a fusion.
float FastAtan2(float y, float x) {
  const float ax = std::abs(x);
  const float ay = std::abs(y);
  const float high = std::max(ax, ay);
  if (high == 0.0f) return 0.0f;
  float angle = ArcTangent(std::min(ax, ay) / high);
  if (ay > ax) angle = static_cast<float>(kPi / 2.0) - angle;
  if (x < 0.0f) angle = static_cast<float>(kPi) - angle;
  return y < 0.0f ? -angle : angle;
}

/// Whether a neighbouring pixel lies off the plane of this one by more than the sampling explains.
bool IsJump(const DepthPixel& here,
            const Eigen::Vector3f& ray,
            float other_m,
            const Eigen::Vector3f& other_ray,
            float tolerance_m) {
  if (other_m <= 0.0f) return false;
  const float off = here.normal.dot(other_m * other_ray - here.range_m * ray);
  return std::abs(off) > tolerance_m;
}

float WeightAt(float range_m, const ViewConfig& config) {
  const float ratio = range_m / static_cast<float>(config.half_weight_range_m);
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace

ViewCamera::ViewCamera(const ViewConfig& config)
    : columns_((config.columns + 3) / 4 * 4), max_range_m_(static_cast<float>(config.max_range_m)) {
  const double step = 2.0 * kPi / columns_;
  const double low = config.lowest_deg * kPi / 180.0;
  const double high = std::max(config.highest_deg * kPi / 180.0, low + 2.0 * step);
  rows_ = std::max(2, static_cast<int>((high - low) / step));
  top_rad_ = high - 0.5 * step;
  bottom_rad_ = top_rad_ - step * (rows_ - 1);
  rows_per_rad_ = static_cast<float>(1.0 / step);
  columns_per_rad_ = static_cast<float>(1.0 / step);
}

SensorModel ViewCamera::Sensor(double min_range_m, double max_range_m) const {
  return UniformSensorModel(rows_, columns_, bottom_rad_, top_rad_, min_range_m, max_range_m);
}

int ViewCamera::Project(const Eigen::Vector3f& point, float range_m) const {
  if (!(range_m > 1e-3f) || range_m > max_range_m_) return -1;
  const float horizontal = std::sqrt(point.x() * point.x() + point.y() * point.y());
  const float elevation = FastAtan2(point.z(), horizontal);
  const float row = (static_cast<float>(top_rad_) - elevation) * rows_per_rad_ + 0.5f;
  if (row < 0.0f || row >= static_cast<float>(rows_)) return -1;
  const float azimuth = FastAtan2(point.y(), point.x());
  const float column = (static_cast<float>(kPi) - azimuth) * columns_per_rad_;
  const int j = static_cast<int>(column);
  return static_cast<int>(row) * columns_ + (j >= columns_ ? 0 : j);
}

Eigen::Vector3f ViewCamera::RayOf(int row, int column) const {
  const double elevation = top_rad_ - row / static_cast<double>(rows_per_rad_);
  const double azimuth = kPi - (column + 0.5) / static_cast<double>(columns_per_rad_);
  return Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation))
      .cast<float>();
}

DepthView MakeDepthView(const ViewCamera& camera,
                        const RenderOutput& render,
                        const SE3& T_map_view,
                        const ViewConfig& config,
                        ThreadPool& pool) {
  const int rows = camera.Rows();
  const int columns = camera.Columns();
  DepthView view{T_map_view, Image<DepthPixel>(rows, columns)};
  const auto min_alpha = static_cast<float>(config.min_alpha);
  const auto disagreement = static_cast<float>(config.max_disagreement);
  ParallelFor(pool, static_cast<std::size_t>(rows), 8, [&](std::size_t begin, std::size_t end) {
    for (int i = static_cast<int>(begin); i < static_cast<int>(end); ++i) {
      for (int j = 0; j < columns; ++j) {
        if (render.alpha(i, j) < min_alpha) continue;
        DepthPixel& pixel = view.pixels(i, j);
        pixel.range_m = render.median_range_m(i, j);
        pixel.normal = render.normal(i, j);
        const Eigen::Vector3f ray = camera.RayOf(i, j);
        const float cosine = -pixel.normal.dot(ray);
        if (!(pixel.range_m > 0.0f) || !(cosine > kMinCosine)) {
          pixel = {};
          continue;
        }
        const float tolerance = disagreement * pixel.range_m;
        // range_m is the mean of expected and median.
        bool mixed = std::abs(render.range_m(i, j) - pixel.range_m) > 0.5f * tolerance;
        const auto jumps_to = [&](int row, int column) {
          return IsJump(
              pixel, ray, render.median_range_m(row, column), camera.RayOf(row, column), tolerance);
        };
        mixed = mixed || jumps_to(i, j + 1 < columns ? j + 1 : 0) ||
                jumps_to(i, j > 0 ? j - 1 : columns - 1) || (i > 0 && jumps_to(i - 1, j)) ||
                (i + 1 < rows && jumps_to(i + 1, j));
        pixel.weight = cosine * (mixed ? kMixedWeight : 1.0f) * WeightAt(pixel.range_m, config);
      }
    }
  });
  return view;
}

}  // namespace covsplat
