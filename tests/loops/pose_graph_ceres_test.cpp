// The same problems for Ceres, written on its own: quaternions and positions, its derivatives.
#include <array>
#include <vector>

#include "tests/loops/pose_graph_fixtures.hpp"
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "covsplat/loops/pose_graph.hpp"

namespace covsplat {
namespace {

using test::Disturbed;
using test::Measured;
using test::Odometry;
using test::SquareWay;

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// Log of a rigid motion [rotation vector, V^-1 translation]; small turns by their series.
template <class T>
Eigen::Matrix<T, 6, 1> LogOf(const Eigen::Quaternion<T>& q, const Vector3<T>& t) {
  const T sine_square = q.vec().squaredNorm();
  T factor = T(2.0);
  if (sine_square > T(1e-20)) {
    const T sine = ceres::sqrt(sine_square);
    factor = T(2.0) * ceres::atan2(q.w() < T(0.0) ? -sine : sine, q.w() < T(0.0) ? -q.w() : q.w()) /
             sine;
  }
  const Vector3<T> omega = factor * q.vec();
  const T square = omega.squaredNorm();
  T c = T(1.0 / 12.0) + square * T(1.0 / 720.0);
  if (square > T(1e-6)) {
    const T theta = ceres::sqrt(square);
    c = (T(1.0) - T(0.5) * theta / ceres::tan(T(0.5) * theta)) / square;
  }
  Eigen::Matrix<T, 6, 1> log;
  log.template head<3>() = omega;
  log.template tail<3>() = t - T(0.5) * omega.cross(t) + c * omega.cross(omega.cross(t));
  return log;
}

struct EdgeResidual {
  template <class T>
  bool operator()(const T* q_from, const T* t_from, const T* q_to, const T* t_to, T* out) const {
    using Q = Eigen::Quaternion<T>;
    const Eigen::Map<const Q> qa(q_from), qb(q_to);
    const Eigen::Map<const Vector3<T>> ta(t_from), tb(t_to);
    const Q q_between = qa.conjugate() * qb;
    const Vector3<T> t_between = qa.conjugate() * (tb - ta);
    const Q q_measured = measured.Rotation().cast<T>();
    const Vector3<T> t_measured = measured.Translation().cast<T>();
    const Q q_error = q_measured.conjugate() * q_between;
    const Vector3<T> t_error = q_measured.conjugate() * (t_between - t_measured);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> residual(out);
    residual = root.cast<T>() * LogOf<T>(q_error, t_error);
    return true;
  }
  SE3 measured;
  Matrix6d root;  ///< of the information
};

/// rho(s) = c s / (c + s).
class GemanMcClure : public ceres::LossFunction {
 public:
  explicit GemanMcClure(double scale) : scale_(scale) {}
  void Evaluate(double s, double out[3]) const override {
    const double part = scale_ / (scale_ + s);
    out[0] = s * part;
    out[1] = part * part;
    out[2] = -2.0 * part * part / (scale_ + s);
  }

 private:
  double scale_;
};

std::vector<SE3> SolveWithCeres(const PoseGraph& graph, double doubt_threshold) {
  std::vector<std::array<double, 4>> q(graph.T_map_node.size());
  std::vector<std::array<double, 3>> t(graph.T_map_node.size());
  ceres::Problem problem;
  for (std::size_t i = 0; i < q.size(); ++i) {
    Eigen::Map<Eigen::Quaterniond>(q[i].data()) = graph.T_map_node[i].Rotation();
    Eigen::Map<Eigen::Vector3d>(t[i].data()) = graph.T_map_node[i].Translation();
    problem.AddParameterBlock(q[i].data(), 4, new ceres::EigenQuaternionManifold);
    problem.AddParameterBlock(t[i].data(), 3);
  }
  problem.SetParameterBlockConstant(q[0].data());
  problem.SetParameterBlockConstant(t[0].data());
  for (const PoseEdge& edge : graph.edges) {
    const auto a = static_cast<std::size_t>(edge.from), b = static_cast<std::size_t>(edge.to);
    const Matrix6d root = edge.information.llt().matrixU();
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EdgeResidual, 6, 4, 3, 4, 3>(
                                 new EdgeResidual{edge.T_from_to, root}),
                             edge.doubtful ? new GemanMcClure(doubt_threshold) : nullptr,
                             q[a].data(),
                             t[a].data(),
                             q[b].data(),
                             t[b].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 500;
  options.function_tolerance = 0.0;
  options.gradient_tolerance = 1e-13;
  options.parameter_tolerance = 1e-15;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < q.size(); ++i) {
    poses.emplace_back(Eigen::Map<Eigen::Quaterniond>(q[i].data()),
                       Eigen::Map<Eigen::Vector3d>(t[i].data()));
  }
  return poses;
}

double WorstDifference(const std::vector<SE3>& a, const std::vector<SE3>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::max(worst, (a[i].Inverse() * b[i]).Log().lpNorm<Eigen::Infinity>());
  }
  return worst;
}

TEST(PoseGraphCeres, SumsOfSquaresHaveTheSameMinimum) {
  const std::vector<SE3> truth = SquareWay(2);
  Rng rng(11);
  PoseGraph graph = Odometry(truth, rng);
  for (int i = 0; i < 200; i += 25) graph.edges.push_back(Measured(truth, i, i + 200, true, rng));
  for (PoseEdge& edge : graph.edges) edge.doubtful = false;
  const PoseGraphSolution solution = Optimize(graph, {});
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(WorstDifference(solution.T_map_node, SolveWithCeres(graph, 1.0)), 1e-9);
}

TEST(PoseGraphCeres, SoHaveDoubtfulLoops) {
  const std::vector<SE3> truth = SquareWay(2);
  Rng rng(12);
  PoseGraph graph = Odometry(truth, rng);
  for (int i = 0; i < 200; i += 25) graph.edges.push_back(Measured(truth, i, i + 200, true, rng));
  PoseEdge wild = Measured(truth, 20, 130, true, rng);
  wild.T_from_to = Disturbed(SE3(), 0.5, 5.0, rng);
  graph.edges.push_back(wild);
  const PoseGraphConfig config;
  const PoseGraphSolution solution = Optimize(graph, config);
  EXPECT_TRUE(solution.converged);
  // Of many minima Ceres finds the one next to where it begins.
  PoseGraph near = graph;
  for (std::size_t i = 1; i < near.T_map_node.size(); ++i) {
    near.T_map_node[i] = Disturbed(solution.T_map_node[i], 1e-4, 1e-3, rng);
  }
  const std::vector<SE3> ceres = SolveWithCeres(near, config.doubt_threshold);
  EXPECT_LT(WorstDifference(solution.T_map_node, ceres), 1e-9);
}

}  // namespace
}  // namespace covsplat
