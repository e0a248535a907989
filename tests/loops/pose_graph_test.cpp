#include "covsplat/loops/pose_graph.hpp"

#include "tests/loops/pose_graph_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

using test::Disturbed;
using test::InformationOf;
using test::Measured;
using test::Odometry;
using test::SquareWay;
using test::WorstPosition;

constexpr int kLap = 200;  // nodes

TEST(PoseGraph, WithoutErrorsEveryPoseIsFoundExactly) {
  const std::vector<SE3> truth = SquareWay(1);
  Rng rng(1);
  PoseGraph graph;
  for (int to = 1; to < kLap; ++to) {
    const auto i = static_cast<std::size_t>(to);
    graph.edges.push_back(
        {to - 1, to, truth[i - 1].Inverse() * truth[i], InformationOf(0.01, 0.1)});
  }
  for (const SE3& pose : truth) graph.T_map_node.push_back(Disturbed(pose, 0.05, 0.5, rng));
  graph.T_map_node[0] = truth[0];
  const PoseGraphSolution solution = Optimize(graph, {});
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(WorstPosition(solution.T_map_node, truth), 1e-8);
  EXPECT_LT(*std::ranges::max_element(solution.squared_error), 1e-12);
}

TEST(PoseGraph, ALoopTakesTheDriftOutOfASquare) {
  const std::vector<SE3> truth = SquareWay(2);
  Rng rng(2);
  PoseGraph graph = Odometry(truth, rng);
  const double drift = WorstPosition(graph.T_map_node, truth);
  for (int i = 0; i < kLap; i += 10) graph.edges.push_back(Measured(truth, i, i + kLap, true, rng));
  const PoseGraphSolution solution = Optimize(graph, {});
  EXPECT_TRUE(solution.converged);
  EXPECT_GT(drift, 3.0);
  EXPECT_LT(WorstPosition(solution.T_map_node, truth), 0.6 * drift);
  // Both laps agree where loops tie them, whatever is left of the drift.
  for (std::size_t i = 0; i <= 190; ++i) {
    const SE3 measured = solution.T_map_node[i].Inverse() * solution.T_map_node[i + kLap];
    const SE3 wanted = truth[i].Inverse() * truth[i + kLap];
    EXPECT_LT((wanted.Inverse() * measured).Translation().norm(), 0.2) << i;
  }
  for (const double weight : solution.weight) EXPECT_GT(weight, 0.2);
}

TEST(PoseGraph, WildLoopsLoseTheirWeightAndDoNoHarm) {
  const std::vector<SE3> truth = SquareWay(2);
  for (const std::uint64_t seed : {3, 4, 5, 6, 7}) {
    Rng rng(seed);
    PoseGraph graph = Odometry(truth, rng);
    for (int i = 0; i < kLap; i += 10) {
      graph.edges.push_back(Measured(truth, i, i + kLap, true, rng));
    }
    const PoseGraphSolution clean = Optimize(graph, {});
    const std::size_t good = graph.edges.size();
    for (int k = 0; k < 20; ++k) {  // as many as true ones
      const int from = static_cast<int>(rng.Below(kLap));
      PoseEdge wild =
          Measured(truth, from, from + 30 + static_cast<int>(rng.Below(150)), true, rng);
      wild.T_from_to = Disturbed(SE3(), 1.0, 10.0, rng);  // "this is the same place"
      graph.edges.push_back(wild);
    }
    const PoseGraphSolution solution = Optimize(graph, {});
    for (std::size_t e = 0; e < graph.edges.size(); ++e) {
      if (e < good) {
        EXPECT_GT(solution.weight[e], 0.1) << "seed " << seed << ", edge " << e;
      } else {
        EXPECT_LT(solution.weight[e], 0.01) << "seed " << seed << ", edge " << e;
      }
    }
    EXPECT_LT(WorstPosition(solution.T_map_node, clean.T_map_node), 0.02) << "seed " << seed;
  }
}

TEST(PoseGraph, APriorPullsThePathToTheMap) {
  const std::vector<SE3> truth = SquareWay(1);
  Rng rng(8);
  PoseGraph graph = Odometry(truth, rng);
  const double drift = WorstPosition(graph.T_map_node, truth);
  for (int i = 20; i < kLap; i += 20) {
    graph.edges.push_back(
        {kMapNode, i, truth[static_cast<std::size_t>(i)], InformationOf(1e-3, 0.01)});
  }
  const PoseGraphSolution solution = Optimize(graph, {});
  EXPECT_GT(drift, 1.0);
  EXPECT_LT(WorstPosition(solution.T_map_node, truth), 0.2);
}

TEST(PoseGraph, WhatNothingTiesStays) {
  PoseGraph graph;
  graph.T_map_node = {SE3(),
                      SE3(Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}),
                      SE3(Eigen::Quaterniond::Identity(), {7.0, 8.0, 9.0})};
  graph.edges = {{0, 1, SE3(Eigen::Quaterniond::Identity(), {2.0, 0.0, 0.0})}};
  const PoseGraphSolution solution = Optimize(graph, {});
  EXPECT_TRUE(solution.converged);
  EXPECT_NEAR(solution.T_map_node[1].Translation().x(), 2.0, 1e-9);
  EXPECT_EQ(solution.T_map_node[2].Translation(), graph.T_map_node[2].Translation());
  EXPECT_TRUE(Optimize(PoseGraph{}, {}).converged);
  EXPECT_TRUE(Optimize(PoseGraph{{SE3()}, {}}, {}).converged);
}

TEST(PoseGraph, APartlyMeasuredPoseMovesWhereItIsMeasured) {
  PoseGraph graph;
  graph.T_map_node = {SE3(), SE3(Eigen::Quaterniond::Identity(), {1.0, 0.5, 0.0})};
  Matrix6d along_x = Matrix6d::Zero();
  along_x(3, 3) = 100.0;
  graph.edges = {{0, 1, SE3(Eigen::Quaterniond::Identity(), {2.0, 0.5, 0.0}), along_x}};
  const PoseGraphSolution solution = Optimize(graph, {});
  EXPECT_LT((solution.T_map_node[1].Translation() - Eigen::Vector3d(2.0, 0.5, 0.0)).norm(), 1e-8);
}

}  // namespace
}  // namespace covsplat
