#include "covsplat/eval/surface_samples.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <tuple>

#include "tests/eval/meshes.hpp"
#include <gtest/gtest.h>

#include "covsplat/eval/voxel_index.hpp"

namespace covsplat {
namespace {

using test::BoxMesh;
using test::Plane;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::vector<Eigen::Vector3d> Sampled(const TriangleMesh& mesh, int threads = 1) {
  ThreadPool pool(threads);
  return SampleMesh(mesh, {}, {}, pool);
}

TEST(SurfaceSamples, EveryVoxelOfAPlaneGetsOnePointOnThePlane) {
  const auto points = Sampled(Plane(0, 0, 1, 2, 0.013f));
  EXPECT_LE(points.size(), 5000u);  // 50 x 100 voxels
  EXPECT_GE(points.size(), 4950u);  // one in e^6 gets no sample
  std::set<std::uint64_t> voxels;
  for (const Eigen::Vector3d& point : points) {
    EXPECT_NEAR(point.z(), 0.013, 1e-6);
    voxels.insert(VoxelGrid{0.02}.KeyOf(point).value());
  }
  EXPECT_EQ(voxels.size(), points.size());
}

TEST(SurfaceSamples, TheyAreEvenByAreaHoweverTheSurfaceIsCut) {
  // One half as two large triangles, the other as 3200 slivers.
  TriangleMesh mesh = Plane(0, 0, 1, 1, 0.0f);
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      const auto x = 1.0f + 0.025f * static_cast<float>(i);
      test::AddQuad({x, 0.025f * static_cast<float>(j), 0}, {0.025f, 0, 0}, {0, 0.025f, 0}, mesh);
    }
  }
  ThreadPool pool(1);
  SamplingOptions few;
  few.samples_per_voxel = 0.5;
  const auto points = SampleMesh(mesh, {}, few, pool);
  const auto right = std::count_if(
      points.begin(), points.end(), [](const Eigen::Vector3d& p) { return p.x() > 1.0; });
  EXPECT_NEAR(static_cast<double>(right) / static_cast<double>(points.size()), 0.5, 0.03);
}

TEST(SurfaceSamples, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = BoxMesh({-5, -1, 0}, {10, 2, 1});  // over several tiles
  EXPECT_EQ(Sampled(mesh, 1), Sampled(mesh, 3));
}

TEST(SurfaceSamples, AreMovedToTheWorld) {
  ThreadPool pool(1);
  const SE3 up(Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitX())),
               {0.0, 0.0, 5.0});
  for (const Eigen::Vector3d& point : SampleMesh(Plane(0, 0, 1, 1, 0), up, {}, pool)) {
    EXPECT_NEAR(point.y(), 0.0, 1e-6);
    EXPECT_GE(point.z(), 5.0 - 1e-6);
  }
}

TEST(SurfaceSamples, BrokenTrianglesAreCountedAndPassedOver) {
  TriangleMesh mesh = Plane(0, 0, 1, 1, 0.0f);
  const auto before = Sampled(mesh);
  mesh.vertices.emplace_back(kNan, 0.0f, 0.0f);
  mesh.triangles.emplace_back(0, 1, 4);  // not finite
  mesh.triangles.emplace_back(0, 1, 1);  // no area
  mesh.triangles.emplace_back(2, 2, 2);
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_EQ(check.not_finite, 1u);
  EXPECT_EQ(check.no_area, 2u);
  EXPECT_NEAR(check.area_m2, 1.0, 1e-6);
  EXPECT_EQ(Sampled(mesh), before);
}

TEST(SurfaceSamples, SurfacesNeedNotBeManifold) {
  TriangleMesh mesh = Plane(0, 0, 1, 1, 0.0f);  // three sheets meet in one edge, one twice
  test::AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, mesh);
  test::AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, mesh);
  test::AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, mesh);
  EXPECT_NEAR(static_cast<double>(Sampled(mesh).size()), 3 * 2500.0, 300.0);
}

TEST(ThinPoints, EachVoxelKeepsTheMeanOfItsPoints) {
  const std::vector<Eigen::Vector3d> points = {
      {0.1, 0.1, 0.1}, {1.5, 0.5, 0.5}, {0.3, 0.5, 0.9}, {-0.1, 0.5, 0.5}, {kNan, 0.0, 0.0}};
  const auto thin = ThinPoints(points, 1.0);
  ASSERT_EQ(thin.size(), 3u);
  EXPECT_TRUE(thin[0].isApprox(Eigen::Vector3d(0.2, 0.3, 0.5)));
  EXPECT_TRUE(thin[1].isApprox(points[1]));
  EXPECT_TRUE(thin[2].isApprox(points[3]));
}

TEST(VoxelGrid, KeysLeadBackToTheirCells) {
  const VoxelGrid grid{0.5};
  const Eigen::Vector3i cell(-3, 0, 700000);
  EXPECT_EQ(VoxelGrid::CellOf(VoxelGrid::KeyOfCell(cell)), cell);
  const auto key = grid.KeyOf(0.5 * cell.cast<double>() + Eigen::Vector3d(0.1, 0.2, 0.4));
  EXPECT_EQ(key, VoxelGrid::KeyOfCell(cell));
  EXPECT_TRUE(grid.CenterOf(*key).isApprox(Eigen::Vector3d(-1.25, 0.25, 350000.25)));
  EXPECT_FALSE(grid.KeyOf({1e9, 0.0, 0.0}));
  EXPECT_FALSE(grid.KeyOf({0.0, static_cast<double>(kNan), 0.0}));
}

}  // namespace
}  // namespace covsplat
