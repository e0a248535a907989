#include "covsplat/eval/surface_error.hpp"

#include <algorithm>
#include <limits>

#include "covsplat/core/check.hpp"
#include "covsplat/core/nearest_points.hpp"

namespace covsplat {
namespace {

double Share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// No distance counts for more than `limit_m`.
double MeanUpTo(std::span<const float> distances_m, double limit_m) {
  double sum = 0.0;
  for (const float d : distances_m) sum += std::min(static_cast<double>(d), limit_m);
  return distances_m.empty() ? 0.0 : sum / static_cast<double>(distances_m.size());
}

double ShareBelow(std::span<const float> distances_m, double limit_m) {
  const auto below = std::count_if(distances_m.begin(), distances_m.end(), [&](float d) {
    return static_cast<double>(d) < limit_m;
  });
  return Share(static_cast<std::size_t>(below), distances_m.size());
}

SurfaceError ErrorOf(std::span<const float> from_result_m,
                     std::span<const float> from_truth_m,
                     const SurfaceErrorOptions& options) {
  SurfaceError error;
  error.result_points = from_result_m.size();
  error.truth_points = from_truth_m.size();
  error.accuracy_m = MeanUpTo(from_result_m, std::numeric_limits<double>::infinity());
  error.completeness_m = MeanUpTo(from_truth_m, options.truncation_m);
  error.chamfer_m = 0.5 * (error.accuracy_m + error.completeness_m);
  for (const double tau_m : options.tau_m) {
    ThresholdScore score{tau_m, ShareBelow(from_result_m, tau_m), ShareBelow(from_truth_m, tau_m)};
    const double sum = score.precision + score.recall;
    if (sum > 0.0) score.f_score = 2.0 * score.precision * score.recall / sum;
    error.scores.push_back(score);
  }
  return error;
}

template <class Keep>
std::vector<float> Filter(std::span<const float> distances_m, Keep&& keep) {
  std::vector<float> kept;
  for (std::size_t i = 0; i < distances_m.size(); ++i) {
    if (keep(i)) kept.push_back(distances_m[i]);
  }
  return kept;
}

SurfaceError WithShares(SurfaceError error, const SurfaceDistances& all) {
  error.result_left_out = 1.0 - Share(error.result_points, all.from_result_m.size());
  error.truth_left_out = 1.0 - Share(error.truth_points, all.from_truth_m.size());
  return error;
}

}  // namespace

SurfaceDistances MeasureDistances(std::span<const Eigen::Vector3d> result,
                                  std::span<const Eigen::Vector3d> truth,
                                  ThreadPool& pool) {
  SurfaceDistances distances;
  distances.from_result_m = NearestPoints(truth).DistancesFrom(result, pool);
  distances.from_truth_m = NearestPoints(result).DistancesFrom(truth, pool);
  return distances;
}

SurfaceError PaperError(const SurfaceDistances& distances, const SurfaceErrorOptions& options) {
  const auto nearer_than = [](std::span<const float> distances_m, double limit_m) {
    return Filter(distances_m,
                  [&](std::size_t i) { return static_cast<double>(distances_m[i]) < limit_m; });
  };
  return WithShares(ErrorOf(nearer_than(distances.from_result_m, options.truncation_m),
                            nearer_than(distances.from_truth_m, options.crop_m),
                            options),
                    distances);
}

SurfaceError StrictError(const SurfaceDistances& distances,
                         std::span<const std::uint8_t> judged_result,
                         std::span<const std::uint8_t> judged_truth,
                         const SurfaceErrorOptions& options) {
  COVSPLAT_CHECK(judged_result.size() == distances.from_result_m.size());
  COVSPLAT_CHECK(judged_truth.size() == distances.from_truth_m.size());
  const auto named = [](std::span<const float> distances_m, std::span<const std::uint8_t> mask) {
    return Filter(distances_m, [&](std::size_t i) { return mask[i] != 0; });
  };
  return WithShares(ErrorOf(named(distances.from_result_m, judged_result),
                            named(distances.from_truth_m, judged_truth),
                            options),
                    distances);
}

}  // namespace covsplat
