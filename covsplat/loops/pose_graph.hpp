// PoseGraph: poses of keyframes and what was measured between them.
#pragma once

#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/se3.hpp"

namespace covsplat {

/// The map itself, as the node that an edge begins at: the edge is then a prior.
inline constexpr int kMapNode = -1;

/// A measured relative pose.
struct PoseEdge {
  int from = 0;  ///< node, or kMapNode
  int to = 0;
  SE3 T_from_to;
  /// Of [rotation, translation], right perturbation, in 1/rad^2 and 1/m^2.
  Matrix6d information = Matrix6d::Identity();
  /// Whether it may be altogether wrong, as loops may and odometry may not.
  bool doubtful = false;
};

struct PoseGraph {
  std::vector<SE3> T_map_node;
  std::vector<PoseEdge> edges;
};

struct PoseGraphConfig {
  int max_iterations = 100;
  double step_epsilon = 1e-9;
  double doubt_threshold = 16.8;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("max_iterations", c.max_iterations, Range{1, 10000}, "steps of the solver at most");
    v.Field("step_epsilon",
            c.step_epsilon,
            Range{0.0, 1.0},
            "converged when no pose moves more than this, rad and m");
    v.Field(
        "doubt_threshold",
        c.doubt_threshold,
        Range{0.1, 1e6},
        "squared error, in variances, at which a loop is as likely wrong as right; 16.8 is what "
        "one of a hundred good ones exceeds");
  }
};

struct PoseGraphSolution {
  std::vector<SE3> T_map_node;
  std::vector<double> squared_error;  ///< [edges] e^T information e
  std::vector<double> weight;         ///< [edges] 1, of doubtful ones down to 0
  int iterations = 0;
  bool converged = false;
};

/// e = Log(T_from_to^-1 * T_map_from^-1 * T_map_to): how far the poses are from what was measured.
Vector6d ErrorOf(const PoseEdge& edge, const std::vector<SE3>& T_map_node);

/// Minimises half the sum of the squared errors over all nodes but the first, which stays; nodes
/// that no edge ties stay, too. The error s of a doubtful edge counts as c s / (c + s) with c =
/// `doubt_threshold` (Geman and McClure). Since that has many minima, it begins as the sum of
/// squares and becomes this by and by (graduated non-convexity: Yang et al., RA-L 2020), so that
/// wrong loops lose their weight whatever the poses to begin with. Levenberg and Marquardt's steps,
/// sparse Cholesky factors; deterministic.
PoseGraphSolution Optimize(const PoseGraph& graph, const PoseGraphConfig& config);

}  // namespace covsplat
