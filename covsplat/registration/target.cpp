#include "covsplat/registration/target.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace covsplat {
namespace {

std::vector<int> SelectUsable(std::span<const TargetSurfel> surfels) {
  std::vector<int> usable;
  usable.reserve(surfels.size());
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const TargetSurfel& s = surfels[i];
    const float norm = s.rotation.coeffs().squaredNorm();
    const bool finite = s.mean.allFinite() && std::isfinite(norm) && std::isfinite(s.scale0) &&
                        std::isfinite(s.scale1) && std::isfinite(s.weight);
    if (finite && norm > 1e-12f) usable.push_back(static_cast<int>(i));
  }
  return usable;
}

std::vector<Eigen::Vector3f> Means(std::span<const TargetSurfel> surfels,
                                   const std::vector<int>& usable) {
  std::vector<Eigen::Vector3f> means;
  means.reserve(usable.size());
  for (const int i : usable) means.push_back(surfels[static_cast<std::size_t>(i)].mean);
  return means;
}

RegistrationTarget::Record MakeRecord(const TargetSurfel& surfel) {
  Eigen::Matrix3f axes = surfel.rotation.normalized().toRotationMatrix();
  float sigma0 = std::abs(surfel.scale0);
  float sigma1 = std::abs(surfel.scale1);
  if (sigma0 < sigma1) {
    std::swap(sigma0, sigma1);
    axes.col(0).swap(axes.col(1));
  }
  return {.mean = surfel.mean,
          .normal = axes.col(2),
          .covariance = SurfaceCovariance(axes, sigma0, sigma1),
          .weight = std::max(surfel.weight, 0.0f)};
}

}  // namespace

Eigen::Matrix<float, 6, 1> SurfaceCovariance(const Eigen::Matrix3f& axes,
                                             float sigma0,
                                             float sigma1) {
  constexpr float kThickness = 1e-3f;
  constexpr float kMaxElongation = 100.0f;
  const float ratio = sigma0 / std::max(sigma1, 1e-6f);
  const float lambda0 = std::clamp(ratio * ratio, 1.0f, kMaxElongation);
  const Eigen::Matrix3f c =
      axes * Eigen::Vector3f(lambda0, 1.0f, kThickness).asDiagonal() * axes.transpose();
  Eigen::Matrix<float, 6, 1> packed;
  packed << c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2);
  return packed;
}

RegistrationTarget::RegistrationTarget(std::span<const TargetSurfel> surfels,
                                       const Eigen::Vector3d& origin_map,
                                       int keyframes,
                                       double cell_m)
    : RegistrationTarget(surfels, SelectUsable(surfels), origin_map, keyframes, cell_m) {}

RegistrationTarget::RegistrationTarget(std::span<const TargetSurfel> surfels,
                                       std::vector<int> usable,
                                       const Eigen::Vector3d& origin_map,
                                       int keyframes,
                                       double cell_m)
    : origin_map_(origin_map),
      keyframes_(keyframes),
      index_(Means(surfels, usable), static_cast<float>(cell_m)) {
  surfel_.reserve(usable.size());
  records_.reserve(usable.size());
  for (std::size_t slot = 0; slot < usable.size(); ++slot) {
    const auto k = static_cast<std::size_t>(index_.IndexOf(static_cast<int>(slot)));
    surfel_.push_back(usable[k]);
    records_.push_back(MakeRecord(surfels[static_cast<std::size_t>(usable[k])]));
  }
}

}  // namespace covsplat
