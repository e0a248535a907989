// Maps of Gaussians at random, for files that hold maps.
#pragma once

#include <cmath>

#include "covsplat/core/rng.hpp"
#include "covsplat/mapping/saved_map.hpp"

namespace covsplat::test {

inline void SetGaussian(SavedMap& map,
                        std::size_t row,
                        const Eigen::Vector3f& mean,
                        const Eigen::Quaternionf& q,
                        const Eigen::Vector2f& scale_m,
                        float opacity_logit) {
  WriteGaussian(
      map.gaussians, row, mean, q, {std::log(scale_m.x()), std::log(scale_m.y())}, opacity_logit);
}

/// Means within +-`extent_m`, every orientation, scales of 2 cm to 1 m, seven keyframes, a sensor
/// and a configuration. Every tenth control score and intensity is unknown.
inline SavedMap RandomMap(std::size_t size, double extent_m, std::uint64_t seed) {
  Rng rng(seed);
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(rng.Uniform(low, high));
  };
  SavedMap map;
  map.Resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Eigen::Quaterniond q(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal());
    SetGaussian(
        map,
        i,
        {uniform(-extent_m, extent_m), uniform(-extent_m, extent_m), uniform(-extent_m, extent_m)},
        q.normalized().cast<float>(),
        {std::exp(uniform(-4.0, 0.0)), std::exp(uniform(-4.0, 0.0))},
        uniform(-4.0, 8.0));
    map.confidence[i] = uniform(0.0, 1.0);
    map.control_score[i] = i % 10 == 0 ? -1.0f : uniform(0.0, 1.0);
    map.intensity[i] = i % 10 == 1 ? 0.0f : std::exp(uniform(-3.0, 9.0));
    map.keyframe[i] = static_cast<int>(rng.Below(7));
    map.last_seen[i] = map.keyframe[i] + static_cast<int>(rng.Below(3));
  }
  for (int k = 0; k < 7; ++k) {
    const Eigen::Quaterniond q(1.0, 0.1 * k, 0.0, 0.2);
    map.keyframes.push_back({1e9 + 0.1 * k, SE3(q, Eigen::Vector3d(k, 0.5 * k, -0.1))});
  }
  map.sensor = UniformSensorModel(16, 1024, -0.3, 0.3, 0.5, 80.0);
  map.config_yaml = "# made by a test\nsensor:\n  columns: 1024\n";
  return map;
}

/// The covariance in the plane: equal for Gaussians that look the same, whatever their numbers.
inline Eigen::Matrix3d CovarianceOf(const SavedMap& map, std::size_t row) {
  const Eigen::Matrix3d R =
      RotationOf(map.gaussians, row).cast<double>().normalized().toRotationMatrix();
  const Eigen::Vector3d scale(std::exp(static_cast<double>(map.gaussians.Column(kLogScaleU)[row])),
                              std::exp(static_cast<double>(map.gaussians.Column(kLogScaleV)[row])),
                              0.0);
  return R * scale.cwiseAbs2().asDiagonal() * R.transpose();
}

inline double AngleBetween(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const Eigen::Vector3d u = a.cast<double>();
  const Eigen::Vector3d v = b.cast<double>();
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

}  // namespace covsplat::test
