// How well a reconstructed surface shows the true one: accuracy, completeness, Chamfer distance,
// precision, recall and F-score, by the protocol of the paper and by a strict one. docs/metrics.md
// has the definitions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/parallel.hpp"

namespace covsplat {

/// Distances both ways between the points of a result and those of the truth.
struct SurfaceDistances {
  std::vector<float> from_result_m;  ///< of each point of the result to the truth
  std::vector<float> from_truth_m;   ///< of each point of the truth to the result
};

SurfaceDistances MeasureDistances(std::span<const Eigen::Vector3d> result,
                                  std::span<const Eigen::Vector3d> truth,
                                  ThreadPool& pool);

struct SurfaceErrorOptions {
  std::vector<double> tau_m = {0.2};  ///< what counts as right for precision and recall
  double truncation_m = 0.5;          ///< no error of completeness counts for more
  double crop_m = 1.2;                ///< paper's protocol: truth farther from the result is cut
};

/// Shares are 0 to 1.
struct ThresholdScore {
  double tau_m = 0.0;
  double precision = 0.0;
  double recall = 0.0;
  double f_score = 0.0;
};

/// All zero where there is no point to judge.
struct SurfaceError {
  std::size_t result_points = 0;  ///< judged
  std::size_t truth_points = 0;   ///< judged
  double result_left_out = 0.0;   ///< share of the result's points that no measure counts
  double truth_left_out = 0.0;    ///< share of the truth's points that no measure counts
  double accuracy_m = 0.0;
  double completeness_m = 0.0;
  double chamfer_m = 0.0;              ///< mean of the two
  std::vector<ThresholdScore> scores;  ///< one per tau
};

/// The paper's: truth beyond `crop_m` of the result is cut, points of the result beyond
/// `truncation_m` of the truth are dropped.
SurfaceError PaperError(const SurfaceDistances& distances, const SurfaceErrorOptions& options);

/// Judges exactly the points that the masks (one entry per point) name, and drops none of them.
SurfaceError StrictError(const SurfaceDistances& distances,
                         std::span<const std::uint8_t> judged_result,
                         std::span<const std::uint8_t> judged_truth,
                         const SurfaceErrorOptions& options);

}  // namespace covsplat
