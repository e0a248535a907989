#include "tests/splat/brute_force.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace covsplat {
namespace {

struct Surfel {
  Eigen::Vector3d centre, axis_u, axis_v, normal;
  double scale_u, scale_v, opacity;
};

Surfel SurfelAt(const GaussianColumns<double>& g, const SE3& T_sensor_anchor, std::size_t i) {
  const Eigen::Quaterniond q(
      g.Column(kQuatW)[i], g.Column(kQuatX)[i], g.Column(kQuatY)[i], g.Column(kQuatZ)[i]);
  const Eigen::Matrix3d axes = T_sensor_anchor.RotationMatrix() * q.normalized().toRotationMatrix();
  const Eigen::Vector3d mean(g.Column(kMeanX)[i], g.Column(kMeanY)[i], g.Column(kMeanZ)[i]);
  return {T_sensor_anchor * mean,
          axes.col(0),
          axes.col(1),
          axes.col(2),
          std::exp(g.Column(kLogScaleU)[i]),
          std::exp(g.Column(kLogScaleV)[i]),
          1.0 / (1.0 + std::exp(-g.Column(kOpacityLogit)[i]))};
}

}  // namespace

PixelSums BlendPixel(const SensorModel& sensor,
                     const RasterConfig& config,
                     const GaussianColumns<double>& gaussians,
                     const SE3& T_sensor_anchor,
                     int row,
                     int column) {
  std::vector<Surfel> surfels;
  for (std::size_t i = 0; i < gaussians.Size(); ++i) {
    surfels.push_back(SurfelAt(gaussians, T_sensor_anchor, i));
  }
  std::stable_sort(surfels.begin(), surfels.end(), [](const Surfel& a, const Surfel& b) {
    return a.centre.norm() < b.centre.norm();
  });
  const double az = sensor.ColumnAzimuth(column);
  const double el = sensor.Elevations()[static_cast<std::size_t>(row)];
  const Eigen::Vector3d ray(std::cos(az) * std::cos(el), std::sin(az) * std::cos(el), std::sin(el));
  PixelSums pixel;
  for (Surfel& s : surfels) {
    const double range = s.centre.norm();
    if (range <= config.near_m || range >= 1.2 * sensor.MaxRange()) continue;
    if (s.normal.dot(s.centre) >= 0.0) {
      if (!config.two_sided) continue;
      s.normal = -s.normal;
    }
    const double n_ray = s.normal.dot(ray);
    const double t = s.normal.dot(s.centre) / n_ray;
    const Eigen::Vector3d x = t * ray - s.centre;
    const double a = s.axis_u.dot(x) / s.scale_u;
    const double b = s.axis_v.dot(x) / s.scale_v;
    const double centre_column = sensor.Columns() * (0.5 - std::atan2(s.centre.y(), s.centre.x()) /
                                                               (2.0 * std::numbers::pi));
    const double centre_row = sensor.RowOf(std::atan2(s.centre.z(), s.centre.head<2>().norm()));
    const double dx = std::remainder(centre_column - (column + 0.5), sensor.Columns());
    const double dy = centre_row - (row + 0.5);
    const double surface = a * a + b * b;
    const double filter = config.lowpass * (dx * dx + dy * dy);
    const bool on_surface =
        std::abs(n_ray) > config.grazing_cosine && t > config.near_m && surface <= filter;
    const double alpha =
        std::min(config.alpha_cap, s.opacity * std::exp(-0.5 * (on_surface ? surface : filter)));
    if (alpha < config.alpha_min || pixel.transmittance <= config.transmittance_min) continue;
    const double depth = on_surface ? t : range;
    const double weight = alpha * pixel.transmittance;
    pixel.range_sum += weight * depth;
    pixel.normal += weight * s.normal;
    if (pixel.transmittance > 0.5) pixel.median = depth;
    pixel.transmittance -= weight;
    pixel.hits.push_back({weight, depth});
  }
  return pixel;
}

}  // namespace covsplat
