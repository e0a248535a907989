#include "covsplat/mapping/signals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "covsplat/core/percentile.hpp"

namespace covsplat {
namespace {

constexpr double kEpsilon = 1e-6;
constexpr double kWeightLinear = 0.55;
constexpr double kWeightCurvature = 0.30;
constexpr double kWeightResidual = 0.15;
constexpr std::size_t kMinMatched = 16;

/// Maps [low, high] to [0, 1] and clips.
struct Normalisation {
  double low = 0.0;
  double high = 0.0;
  double operator()(double value) const {
    return high > low ? std::clamp((value - low) / (high - low + kEpsilon), 0.0, 1.0) : 0.0;
  }
};

double Linearity(const Eigen::Vector3f& sigma) {
  const Eigen::Vector3d lambda = sigma.cast<double>().cwiseAbs2();
  return (lambda[0] - lambda[1]) / (lambda[0] + kEpsilon);
}

double Curvature(const Eigen::Vector3f& sigma) {
  const Eigen::Vector3d lambda = sigma.cast<double>().cwiseAbs2();
  return lambda[2] / (lambda.sum() + kEpsilon);
}

}  // namespace

double PhysicalConfidence(double range_m, double incidence_cosine, const ConfidenceConfig& config) {
  const double ratio = range_m / config.range_m;
  const double incidence =
      (incidence_cosine - config.min_cosine) / (1.0 - config.min_cosine + kEpsilon);
  return std::exp(-ratio * ratio) * std::clamp(incidence, 0.0, 1.0);
}

std::vector<float> ControlScores(std::span<const PointCovariance> covariance,
                                 std::span<const float> squared_distance) {
  std::vector<float> score(covariance.size(), std::numeric_limits<float>::quiet_NaN());
  if (squared_distance.size() != covariance.size()) return score;
  std::vector<double> linear;
  std::vector<double> curvature;
  std::vector<double> residual;
  for (std::size_t i = 0; i < covariance.size(); ++i) {
    if (!std::isfinite(squared_distance[i])) continue;
    linear.push_back(Linearity(covariance[i].sigma_m));
    curvature.push_back(Curvature(covariance[i].sigma_m));
    residual.push_back(std::sqrt(static_cast<double>(squared_distance[i])));
  }
  if (linear.size() < kMinMatched) return score;
  const Normalisation by_linear{Percentile(linear, 0.05), Percentile(linear, 0.95)};
  const Normalisation by_curvature{Percentile(curvature, 0.05), Percentile(curvature, 0.95)};
  const Normalisation by_residual{0.0, Percentile(residual, 0.95)};
  for (std::size_t i = 0; i < covariance.size(); ++i) {
    if (!std::isfinite(squared_distance[i])) continue;
    const double c =
        kWeightLinear * by_linear(Linearity(covariance[i].sigma_m)) +
        kWeightCurvature * by_curvature(Curvature(covariance[i].sigma_m)) +
        kWeightResidual * by_residual(std::sqrt(static_cast<double>(squared_distance[i])));
    score[i] = static_cast<float>(std::clamp(c, 0.0, 1.0));
  }
  return score;
}

}  // namespace covsplat
