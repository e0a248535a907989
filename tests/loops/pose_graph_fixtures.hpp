// Pose graphs whose truth is known.
#pragma once

#include <numbers>

#include "covsplat/core/rng.hpp"
#include "covsplat/loops/pose_graph.hpp"

namespace covsplat::test {

/// Information of errors of these standard deviations.
inline Matrix6d InformationOf(double rotation_rad, double translation_m) {
  Vector6d diagonal;
  diagonal.head<3>().setConstant(1.0 / (rotation_rad * rotation_rad));
  diagonal.tail<3>().setConstant(1.0 / (translation_m * translation_m));
  return diagonal.asDiagonal();
}

inline SE3 Disturbed(const SE3& pose, double rotation_rad, double translation_m, Rng& rng) {
  Vector6d error;
  for (int k = 0; k < 3; ++k) error[k] = rotation_rad * rng.Normal();
  for (int k = 3; k < 6; ++k) error[k] = translation_m * rng.Normal();
  return pose * SE3::Exp(error);
}

/// Laps round a square of 100 m, a pose every 2 m, that turn with the way and climb 5 cm each step.
inline std::vector<SE3> SquareWay(int laps) {
  constexpr int kSteps = 50;
  std::vector<SE3> way;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (int side = 0; side < 4 * laps; ++side) {
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(0.5 * std::numbers::pi * side, Eigen::Vector3d::UnitZ()));
    for (int step = 0; step < kSteps; ++step) {
      way.emplace_back(turn, at);
      at += turn * Eigen::Vector3d(2.0, 0.0, 0.05);
    }
  }
  return way;
}

constexpr double kOdometryRad = 2e-3;
constexpr double kOdometryM = 0.02;
constexpr double kLoopRad = 1e-3;
constexpr double kLoopM = 0.01;

inline PoseEdge Measured(const std::vector<SE3>& truth, int from, int to, bool loop, Rng& rng) {
  const SE3 T_from_to =
      truth[static_cast<std::size_t>(from)].Inverse() * truth[static_cast<std::size_t>(to)];
  const double rad = loop ? kLoopRad : kOdometryRad;
  const double m = loop ? kLoopM : kOdometryM;
  return {from, to, Disturbed(T_from_to, rad, m, rng), InformationOf(rad, m), loop};
}

/// Noisy odometry along a way; the poses are those that it adds up to.
inline PoseGraph Odometry(const std::vector<SE3>& truth, Rng& rng) {
  PoseGraph graph;
  graph.T_map_node = {truth[0]};
  for (int to = 1; to < static_cast<int>(truth.size()); ++to) {
    graph.edges.push_back(Measured(truth, to - 1, to, false, rng));
    graph.T_map_node.push_back(graph.T_map_node.back() * graph.edges.back().T_from_to);
  }
  return graph;
}

inline double WorstPosition(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    worst = std::max(worst, (poses[i].Translation() - truth[i].Translation()).norm());
  }
  return worst;
}

}  // namespace covsplat::test
