#include "covsplat/mesh/dual_contouring.hpp"

#include <cmath>
#include <functional>

#include "tests/mesh/mesh_checks.hpp"
#include <gtest/gtest.h>

#include "covsplat/mesh/clean_mesh.hpp"
#include "covsplat/mesh/tiling.hpp"

namespace covsplat::test {
namespace {

using Vector = Eigen::Vector3d;
using Field = std::function<double(const Vector&)>;
using Normal = std::function<Vector(const Vector&)>;

constexpr double kVoxel = 0.1;
const Vector kBox(1.03, 0.77, 1.26);  // half its size

std::vector<BlockIndex> Cube(int low, int high) {
  std::vector<BlockIndex> blocks;
  for (int z = low; z < high; ++z) {
    for (int y = low; y < high; ++y) {
      for (int x = low; x < high; ++x) blocks.emplace_back(x, y, z);
    }
  }
  return blocks;
}

/// The nearest face's normal, as a view of that face would leave it.
Vector BoxNormal(const Vector& p) {
  int axis = 0;
  (p.cwiseAbs() - kBox).maxCoeff(&axis);
  return std::copysign(1.0, p[axis]) * Vector::Unit(axis);
}

void Fill(const Field& field, const Normal& normal, VoxelGrid& grid) {
  for (std::size_t b = 0; b < grid.Size(); ++b) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      const Eigen::Vector3i at =
          kBlockSide * grid.Block(b) + Eigen::Vector3i(i % 8, i / 8 % 8, i / 64);
      const Vector p = kVoxel * at.cast<double>();
      Voxel& voxel = grid.Voxels(b)[static_cast<std::size_t>(i)];
      voxel.weight = 2.0f;
      voxel.distance = 2.0f * static_cast<float>(field(p) / kVoxel);
      if (normal) voxel.normal = 2.0f * normal(p).cast<float>();
    }
  }
}

/// Contours a field tile by tile.
TriangleMesh MeshOf(const Field& field, int max_blocks, int threads, const Normal& normal = {}) {
  ThreadPool pool(threads);
  std::vector<SurfacePiece> pieces;
  for (const Tile& tile : SplitIntoTiles(Cube(-3, 3), max_blocks)) {
    VoxelGrid grid(kVoxel, tile.padded);
    Fill(field, normal, grid);
    pieces.push_back(Contour(grid, tile.own, {0.5, 1.0}, pool));
  }
  return JoinPieces(std::move(pieces));
}

double Sphere(const Vector& p) { return (p - Vector(0.03, -0.02, 0.01)).norm() - 1.5; }

double Box(const Vector& p) {
  const Vector q = p.cwiseAbs() - kBox;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

TEST(DualContouring, ASphereIsWatertightFacesOutwardsAndIsAccurateToThreeHundredthsOfAVoxel) {
  const TriangleMesh mesh = MeshOf(Sphere, 1000, 1);
  EXPECT_TRUE(IsWatertight(mesh));
  EXPECT_LT(Farthest(mesh, [](const Vector& p) { return std::abs(Sphere(p)); }), 0.03 * kVoxel);
  double volume = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    volume += static_cast<double>(at(0).dot(at(1).cross(at(2)))) / 6.0;
  }
  EXPECT_NEAR(volume, 4.0 / 3.0 * M_PI * std::pow(1.5, 3), 0.1);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_GT(mesh.normals[i].dot(mesh.vertices[i].normalized()), 0.99f);
  }
}

TEST(DualContouring, EdgesAndCornersOfABoxStaySharp) {
  const TriangleMesh mesh = MeshOf(Box, 1000, 1, BoxNormal);
  EXPECT_TRUE(IsWatertight(mesh));
  EXPECT_LT(Farthest(mesh, [](const Vector& p) { return std::abs(Box(p)); }), 0.1 * kVoxel);
  double nearest = 1.0;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    nearest = std::min(nearest, (v.cast<double>() - kBox).norm());
  }
  EXPECT_LT(nearest, 0.5 * kVoxel);
}

TEST(DualContouring, AWallThinnerThanAVoxelKeepsBothSides) {
  const auto wall = [](const Vector& p) {
    const Vector q = p.cwiseAbs() - Vector(1.5, 1.5, 0.08);
    return q.maxCoeff();
  };
  const TriangleMesh mesh = MeshOf(wall, 1000, 1);
  EXPECT_TRUE(IsWatertight(mesh));
  EXPECT_LT(Farthest(mesh, [&](const Vector& p) { return std::abs(wall(p)); }), 0.2 * kVoxel);
}

TEST(DualContouring, TilesAndThreadsLeaveNoTrace) {
  const TriangleMesh whole = MeshOf(Sphere, 1000, 1);
  for (const auto& [max_blocks, threads] : {std::pair{20, 1}, {7, 2}}) {
    const TriangleMesh tiled = MeshOf(Sphere, max_blocks, threads);
    EXPECT_EQ(whole.vertices, tiled.vertices);
    EXPECT_EQ(whole.normals, tiled.normals);
    EXPECT_EQ(whole.triangles, tiled.triangles);
  }
}

TEST(DualContouring, TheSurfaceEndsWhereNothingWasObserved) {
  ThreadPool pool(1);
  VoxelGrid grid(kVoxel, Cube(-3, 3));
  Fill(Sphere, {}, grid);
  for (std::size_t b = 0; b < grid.Size(); ++b) {
    if (grid.Block(b).z() < 0) continue;
    for (Voxel& voxel : grid.Voxels(b)) voxel = {};
  }
  const TriangleMesh mesh = JoinPieces({Contour(grid, Cube(-3, 3), {0.5, 1.0}, pool)});
  ASSERT_FALSE(mesh.triangles.empty());
  EXPECT_LE(Farthest(mesh, [](const Vector& p) { return p.z(); }), 0.0);
}

TEST(CleanMesh, DropsSmallPiecesAndKeepsTheRestInOrder) {
  const auto two = [](const Vector& p) {
    return std::min(p.norm() - 1.0, (p - Vector(1.9, 0.0, 0.0)).norm() - 0.2);
  };
  TriangleMesh mesh = MeshOf(two, 1000, 1);
  const std::size_t before = mesh.vertices.size();
  DropSmallComponents(1.0, mesh);  // the small one has 0.5 m^2
  EXPECT_LT(mesh.vertices.size(), before);
  EXPECT_EQ(mesh.normals.size(), mesh.vertices.size());
  EXPECT_TRUE(IsWatertight(mesh));
  EXPECT_LT(Farthest(mesh, [](const Vector& p) { return p.norm(); }), 1.1);
  DropSmallComponents(1e6, mesh);
  EXPECT_TRUE(mesh.triangles.empty());
  EXPECT_TRUE(mesh.vertices.empty());
}

}  // namespace
}  // namespace covsplat::test
