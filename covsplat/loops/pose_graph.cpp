#include "covsplat/loops/pose_graph.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/loops/block_matrix.hpp"

namespace covsplat {
namespace {

// Geman and McClure's kernel and its slope by the squared error.
double KernelValue(double square, double scale) { return scale * square / (scale + square); }
double KernelWeight(double square, double scale) {
  const double part = scale / (scale + square);
  return part * part;
}

class Solver {
 public:
  Solver(const PoseGraph& graph, const PoseGraphConfig& config)
      : graph_(graph), config_(config), hessian_(Variables(graph), Pattern(graph)) {
    solution_.T_map_node = graph.T_map_node;
  }

  PoseGraphSolution Run() && {
    constexpr double kNarrowing = 2.0;
    for (double width = FirstWidth(); width > 1.0 && MayStep(); width /= kNarrowing) {
      JudgeBy(width * config_.doubt_threshold);
      Step();
    }
    JudgeBy(config_.doubt_threshold);
    while (!solution_.converged && MayStep()) Step();
    return Finish();
  }

 private:
  static constexpr double kMaxDamping = 1e12;
  static constexpr double kFirstDamping = 1e-6;

  // The first node stays and is no variable: variable v is node v + 1.
  static int Variables(const PoseGraph& graph) {
    return std::max(0, static_cast<int>(graph.T_map_node.size()) - 1);
  }

  static std::vector<std::pair<int, int>> Pattern(const PoseGraph& graph) {
    std::vector<std::pair<int, int>> pattern;
    for (const PoseEdge& edge : graph.edges) {
      if (std::min(edge.from, edge.to) < 1) continue;
      pattern.emplace_back(std::max(edge.from, edge.to) - 1, std::min(edge.from, edge.to) - 1);
    }
    return pattern;
  }

  // So wide that the worst edge is judged as by its square.
  double FirstWidth() const {
    double worst = 0.0;
    for (const PoseEdge& edge : graph_.edges) {
      if (edge.doubtful) worst = std::max(worst, SquaredError(edge, solution_.T_map_node));
    }
    return 2.0 * worst / config_.doubt_threshold;
  }

  static double SquaredError(const PoseEdge& edge, const std::vector<SE3>& poses) {
    const Vector6d error = ErrorOf(edge, poses);
    return error.dot(edge.information * error);
  }

  double Cost(const std::vector<SE3>& poses) const {
    double cost = 0.0;
    for (const PoseEdge& edge : graph_.edges) {
      const double square = SquaredError(edge, poses);
      cost += edge.doubtful ? KernelValue(square, scale_) : square;
    }
    return 0.5 * cost;
  }

  void Linearize() {
    hessian_.SetZero();
    gradient_ = Eigen::VectorXd::Zero(Eigen::Index{6} * Variables(graph_));
    for (const PoseEdge& edge : graph_.edges) AddEdge(edge);
  }

  void AddEdge(const PoseEdge& edge) {
    const Vector6d error = ErrorOf(edge, solution_.T_map_node);
    const double square = error.dot(edge.information * error);
    const double weight = edge.doubtful ? KernelWeight(square, scale_) : 1.0;
    const Matrix6d information = weight * edge.information;
    const Matrix6d by_to = InverseRightJacobian(error);
    AddTerm(edge.to, by_to, information, error);
    if (edge.from == kMapNode) return;
    const SE3 T_to_from = Pose(edge.to).Inverse() * Pose(edge.from);
    const Matrix6d by_from = -by_to * T_to_from.Adjoint();
    AddTerm(edge.from, by_from, information, error);
    if (std::min(edge.from, edge.to) < 1) return;
    const Matrix6d cross = by_to.transpose() * information * by_from;
    if (edge.to > edge.from) {
      hessian_.Add(edge.to - 1, edge.from - 1, cross);
    } else {
      hessian_.Add(edge.from - 1, edge.to - 1, cross.transpose());
    }
  }

  void AddTerm(int node,
               const Matrix6d& by_node,
               const Matrix6d& information,
               const Vector6d& error) {
    if (node == 0) return;
    const Matrix6d weighted = by_node.transpose() * information;
    hessian_.Add(node - 1, node - 1, weighted * by_node);
    gradient_.segment<6>(Eigen::Index{6} * (node - 1)) += weighted * error;
  }

  const SE3& Pose(int node) const { return solution_.T_map_node[static_cast<std::size_t>(node)]; }

  bool MayStep() const { return solution_.iterations < config_.max_iterations; }

  void JudgeBy(double scale) {
    scale_ = scale;
    damping_ = 0.0;
    solution_.converged = false;
  }

  // One step that makes the cost no larger, or the end.
  void Step() {
    ++solution_.iterations;
    const double cost = Cost(solution_.T_map_node);
    Linearize();
    for (; damping_ < kMaxDamping; damping_ = std::max(kFirstDamping, 10.0 * damping_)) {
      const Eigen::VectorXd step = hessian_.Solve(-gradient_, damping_);
      if (!step.allFinite()) continue;
      std::vector<SE3> moved = Moved(step);
      const bool small = step.size() == 0 || step.lpNorm<Eigen::Infinity>() < config_.step_epsilon;
      // Of a step this small, rounding decides whether the cost falls.
      if (!small && Cost(moved) > cost) continue;
      solution_.T_map_node = std::move(moved);
      solution_.converged = small;
      damping_ *= 0.1;
      return;
    }
    solution_.converged = true;  // no way down is left
  }

  std::vector<SE3> Moved(const Eigen::VectorXd& step) const {
    std::vector<SE3> moved = solution_.T_map_node;
    for (int v = 0; v < Variables(graph_); ++v) {
      SE3& pose = moved[static_cast<std::size_t>(v) + 1];
      pose = pose * SE3::Exp(step.segment<6>(Eigen::Index{6} * v));
    }
    return moved;
  }

  PoseGraphSolution Finish() {
    for (const PoseEdge& edge : graph_.edges) {
      const double square = SquaredError(edge, solution_.T_map_node);
      solution_.squared_error.push_back(square);
      solution_.weight.push_back(edge.doubtful ? KernelWeight(square, config_.doubt_threshold)
                                               : 1.0);
    }
    return std::move(solution_);
  }

  const PoseGraph& graph_;
  const PoseGraphConfig& config_;
  BlockMatrix hessian_;
  Eigen::VectorXd gradient_;
  PoseGraphSolution solution_;
  double scale_ = 1.0;  // of the kernel, at the moment
  double damping_ = 0.0;
};

}  // namespace

Vector6d ErrorOf(const PoseEdge& edge, const std::vector<SE3>& T_map_node) {
  const SE3& T_map_to = T_map_node[static_cast<std::size_t>(edge.to)];
  if (edge.from == kMapNode) return (edge.T_from_to.Inverse() * T_map_to).Log();
  const SE3& T_map_from = T_map_node[static_cast<std::size_t>(edge.from)];
  return (edge.T_from_to.Inverse() * T_map_from.Inverse() * T_map_to).Log();
}

PoseGraphSolution Optimize(const PoseGraph& graph, const PoseGraphConfig& config) {
  const auto nodes = static_cast<int>(graph.T_map_node.size());
  for (const PoseEdge& edge : graph.edges) {
    COVSPLAT_CHECK(edge.to >= 0 && edge.to < nodes && edge.from < nodes && edge.from != edge.to);
    COVSPLAT_CHECK(edge.from >= 0 || edge.from == kMapNode);
  }
  return Solver(graph, config).Run();
}

}  // namespace covsplat
