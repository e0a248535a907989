#include "covsplat/loops/odometry_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace covsplat {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kDimensions = 6.0;

/// Diagonal of a covariance of rotations and translations.
Vector6d Variances(double sigma_rad, double sigma_m) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variances;
}

Matrix6d InverseOf(const Matrix6d& matrix) {
  const Matrix6d inverse = matrix.ldlt().solve(Matrix6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

}  // namespace

Matrix6d StepCovariance(const std::optional<Matrix6d>& information,
                        double way_m,
                        const OdometryNoiseConfig& config) {
  constexpr double kLeastWayM = 0.1;
  const double way = std::max(way_m, kLeastWayM);
  Matrix6d covariance = Matrix6d::Zero();
  if (information) {
    const Vector6d weak = way * Variances(config.weak_sigma_deg * kDegree, config.weak_sigma_m);
    Matrix6d known = *information;
    known.diagonal() += weak.cwiseInverse();
    covariance = InverseOf(known);
  }
  covariance.diagonal() += way * Variances(config.sigma_deg * kDegree, config.sigma_m);
  return covariance;
}

void OdometryChain::Append(const SE3& T_odom_node, const Matrix6d& covariance) {
  const Matrix6d adjoint = T_odom_node.Adjoint();
  const Matrix6d before =
      covariance_at_origin_.empty() ? Matrix6d::Zero() : covariance_at_origin_.back();
  covariance_at_origin_.push_back(before + adjoint * covariance * adjoint.transpose());
  T_odom_node_.push_back(T_odom_node);
}

double OdometryChain::SquaredError(const PoseEdge& loop, double scale) const {
  const auto first = static_cast<std::size_t>(std::min(loop.from, loop.to));
  const auto last = static_cast<std::size_t>(std::max(loop.from, loop.to));
  const SE3 T_from_to = PoseOf(loop.from).Inverse() * PoseOf(loop.to);
  const Vector6d error = (loop.T_from_to.Inverse() * T_from_to).Log();
  const Matrix6d adjoint = PoseOf(loop.to).Inverse().Adjoint();
  const Matrix6d at_origin = covariance_at_origin_[last] - covariance_at_origin_[first];
  const Matrix6d way = InverseOf(scale * adjoint * at_origin * adjoint.transpose());
  // The loop may say nothing of some directions, so that L does not exist: by information matrices.
  const Vector6d pull = loop.information * error;
  return error.dot(pull) - pull.dot((loop.information + way).ldlt().solve(pull));
}

double OdometryChain::ScaleBy(std::span<const PoseEdge> loops, double max_scale) const {
  constexpr int kHalvings = 30;
  if (loops.empty()) return 1.0;
  const auto is_too_small = [&](double scale) {
    double sum = 0.0;
    for (const PoseEdge& loop : loops) sum += SquaredError(loop, scale);
    return sum > kDimensions * static_cast<double>(loops.size());
  };
  if (!is_too_small(1.0)) return 1.0;
  double low = 0.0;
  double high = std::log(max_scale);
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (is_too_small(std::exp(middle)) ? low : high) = middle;
  }
  return std::exp(high);
}

}  // namespace covsplat
