// What the paper reports of its own system, to stand beside what we measure.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace covsplat {

/// Of the map, by the protocol that docs/metrics.md calls the paper's.
struct PaperMapResult {
  double accuracy_cm = 0.0;
  double completeness_cm = 0.0;
  double chamfer_l1_cm = 0.0;
  double f_score_percent = 0.0;  ///< at 0.2 m
  double scans_per_s = 0.0;      ///< tracking and mapping, on a Ryzen 9 7900X with an RTX 4090
};

/// One sequence.
struct PaperResult {
  std::string_view data_set;  ///< as `covsplat bench` names it
  std::string_view sequence;
  double ate_rmse_m = 0.0;
  std::optional<PaperMapResult> map;
  std::optional<int> gaussians;
  std::optional<double> map_mb;
};

/// All sequences of the paper. Source: Tak, Jeon et al., "Real-Time LiDAR Gaussian Splatting SLAM
/// via Geometry-Aware Covariance Coupling": the tables of trajectories, of mapping quality and of
/// map management (with splitting and plane pruning), and for KITTI 00 its section on long runs.
std::span<const PaperResult> PaperResults();

/// Nothing if the paper does not have it.
std::optional<PaperResult> FindPaperResult(std::string_view data_set, std::string_view sequence);

}  // namespace covsplat
