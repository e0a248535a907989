#include "covsplat/loops/stitch.hpp"

#include <algorithm>
#include <cstdio>

#include "tests/loops/block_city.hpp"
#include "tests/loops/pose_graph_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

/// Two passes of a stretch of 20 m, a keyframe every 2 m, the second one off by some centimetres.
class StitchTest : public ::testing::Test {
 protected:
  static constexpr int kPass = 11;

  StitchTest() {
    Rng rng(3);
    const RayScene city = BlockCity();
    for (int k = 0; k < 2 * kPass; ++k) {
      truth_.push_back(RoundTheBlock(10.0 + 2.0 * (k % kPass)));
      way_m_.push_back(2.0 * k + (k < kPass ? 0.0 : 200.0));
      const Place place = PlaceAt(city, k, truth_.back(), static_cast<std::uint64_t>(k), pool_);
      for (const PlacePoint& point : place.points) {
        if (point.IsFlat()) surfels_.push_back({k, point.Position(), point.Normal()});
      }
    }
    const SE3 off = MakePose(0.002, -0.003, 0.002, 0.08, -0.06, 0.04);
    poses_ = truth_;
    for (int k = kPass; k < 2 * kPass; ++k) At(poses_, k) = At(truth_, k) * off;
    graph_.T_map_node = poses_;
    for (int k = 1; k < 2 * kPass; ++k) {
      if (k == kPass) continue;  // nothing but surfaces ties the passes
      graph_.edges.push_back(
          {k - 1, k, At(truth_, k - 1).Inverse() * At(truth_, k), InformationOf(1e-3, 0.01)});
    }
  }

  static SE3& At(std::vector<SE3>& poses, int k) { return poses[static_cast<std::size_t>(k)]; }

  std::vector<PoseEdge> Edges(const std::vector<SE3>& poses) {
    return StitchEdges(surfels_, poses, way_m_, 30.0, {}, pool_);
  }

  ThreadPool pool_{2};
  std::vector<SE3> truth_;
  std::vector<SE3> poses_;
  std::vector<double> way_m_;
  std::vector<AnchoredSurfel> surfels_;
  PoseGraph graph_;
};

TEST_F(StitchTest, BringsTwoPassesTogetherToMillimetres) {
  PoseGraph graph = graph_;
  const std::size_t odometry = graph.edges.size();
  for (int round = 0; round < StitchConfig().rounds; ++round) {
    graph.edges.resize(odometry);
    for (const PoseEdge& edge : Edges(graph.T_map_node)) graph.edges.push_back(edge);
    graph.T_map_node = Optimize(graph, {}).T_map_node;
  }
  double worst_m = 0.0;
  double worst_rad = 0.0;
  for (int k = 0; k < 2 * kPass; ++k) {
    worst_m = std::max(worst_m, TranslationError(At(graph.T_map_node, k), At(truth_, k)));
    worst_rad = std::max(worst_rad, RotationError(At(graph.T_map_node, k), At(truth_, k)));
  }
  std::printf(
      "off 108 mm and 4.1 mrad, then %.1f mm and %.2f mrad\n", 1e3 * worst_m, 1e3 * worst_rad);
  EXPECT_LT(worst_m, 0.01);
  EXPECT_LT(worst_rad, 1e-3);
}

TEST_F(StitchTest, TiesOnlyDifferentPasses) {
  for (const PoseEdge& edge : Edges(poses_)) {
    EXPECT_NE(edge.from < kPass, edge.to < kPass);
    EXPECT_FALSE(edge.doubtful);
  }
  std::vector<double> one_pass(way_m_.size());
  for (std::size_t k = 0; k < one_pass.size(); ++k) one_pass[k] = static_cast<double>(k);
  EXPECT_TRUE(StitchEdges(surfels_, poses_, one_pass, 30.0, {}, pool_).empty());
}

TEST_F(StitchTest, OfAPlaneTellsOnlyWhatAPlaneCan) {
  std::vector<AnchoredSurfel> plane;
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < 400; ++i) {
      const auto x = static_cast<float>(0.2 * (i % 20)), y = static_cast<float>(0.2 * (i / 20));
      plane.push_back({k, {x, y, -1.0f}, {0.0f, 0.0f, 1.0f}});
    }
  }
  const std::vector<SE3> poses = {SE3(), MakePose(0.0, 0.0, 0.0, 0.05, 0.05, 0.05)};
  const std::vector<double> way_m = {0.0, 100.0};
  const auto edges = StitchEdges(plane, poses, way_m, 30.0, {}, pool_);
  ASSERT_EQ(edges.size(), 2u);
  for (const PoseEdge& edge : edges) {
    EXPECT_NEAR(edge.T_from_to.Translation().z(), 0.0, 1e-3);
    EXPECT_NEAR(std::abs(edge.T_from_to.Translation().x()), 0.05, 1e-3);
    EXPECT_EQ(edge.information(3, 3), 0.0);
    EXPECT_GT(edge.information(5, 5), 1000.0);
  }
}

}  // namespace
}  // namespace covsplat::test
