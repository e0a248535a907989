// Small scenes of Gaussians for the rasteriser's tests.
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "covsplat/core/rng.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/gaussians.hpp"

namespace covsplat {

/// A small sensor with uneven beams, so that the row table has real slopes.
inline SensorModel SmallSensor(int columns = 64) {
  std::vector<double> elevation_rad;
  double elevation = 0.35;
  for (int i = 0; i < 18; ++i) {
    elevation_rad.push_back(elevation);
    elevation -= 0.03 + 0.001 * i;
  }
  return {elevation_rad, columns, 0.5, 30.0};
}

template <class S>
void SetGaussian(GaussianColumns<S>& table,
                 std::size_t i,
                 const Eigen::Vector3d& mean,
                 const Eigen::Quaterniond& q,
                 double scale_u,
                 double scale_v,
                 double opacity) {
  const double values[kParameterCount] = {mean.x(),
                                          mean.y(),
                                          mean.z(),
                                          q.w(),
                                          q.x(),
                                          q.y(),
                                          q.z(),
                                          std::log(scale_u),
                                          std::log(scale_v),
                                          std::log(opacity / (1.0 - opacity))};
  for (int p = 0; p < kParameterCount; ++p) table.Column(p)[i] = static_cast<S>(values[p]);
}

/// Gaussians of random pose and size in front of azimuth `centre_rad`, facing the origin; the
/// smallest are far below a pixel, so that the screen-space filter decides for them.
template <class S>
GaussianColumns<S> RandomGaussians(std::size_t count, double centre_rad, std::uint64_t seed) {
  GaussianColumns<S> table;
  table.Resize(count);
  Rng rng(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const double az = centre_rad + rng.Uniform(-0.5, 0.5);
    const double el = rng.Uniform(-0.25, 0.3);
    const double range = rng.Uniform(3.0, 8.0);
    const Eigen::Vector3d ray(
        std::cos(az) * std::cos(el), std::sin(az) * std::cos(el), std::sin(el));
    const Eigen::Vector3d tilt(rng.Normal(), rng.Normal(), rng.Normal());
    const Eigen::Vector3d normal = (-ray + 0.35 * tilt).normalized();
    Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    q = q * Eigen::AngleAxisd(rng.Uniform(0.0, 6.0), Eigen::Vector3d::UnitZ());
    const double size = rng.Uniform() < 0.3 ? 0.05 : 0.5;
    SetGaussian(table,
                i,
                range * ray,
                q,
                size * rng.Uniform(0.5, 1.5),
                size * rng.Uniform(0.5, 1.5),
                rng.Uniform(0.2, 0.9));
  }
  return table;
}

template <class To, class From>
GaussianColumns<To> Convert(const GaussianColumns<From>& from) {
  GaussianColumns<To> to;
  to.Resize(from.Size());
  for (int p = 0; p < kParameterCount; ++p) {
    for (std::size_t i = 0; i < from.Size(); ++i) {
      to.Column(p)[i] = static_cast<To>(from.Column(p)[i]);
    }
  }
  return to;
}

}  // namespace covsplat
