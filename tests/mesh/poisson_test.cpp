#include "covsplat/mesh/poisson.hpp"

#include <algorithm>
#include <cmath>

#include "tests/mesh/room_map.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kVoxel = 0.1;

MeshConfig Config() {
  MeshConfig config;
  config.method = MeshMethod::kPoisson;
  config.voxel_m = kVoxel;
  config.threads = 1;
  return config;
}

/// Skips the test, saying why, in builds without the library.
#define MESH_OR_SKIP(mesh, map)                                    \
  const Result<MeshResult> result = PoissonOfMap(map, Config());   \
  if (!result && result.error().code == ErrorCode::kUnavailable) { \
    GTEST_SKIP() << result.error().message;                        \
  }                                                                \
  ASSERT_TRUE(result) << result.error().message;                   \
  const TriangleMesh& mesh = result->mesh

TEST(Poisson, WithoutItsLibraryItSaysHowToGetIt) {
  const Result<MeshResult> result = PoissonOfMap(RoomMap(), Config());
  if (result) GTEST_SKIP() << "the library is there";
  EXPECT_EQ(result.error().code, ErrorCode::kUnavailable);
  EXPECT_NE(result.error().message.find("setup.sh"), std::string::npos);
}

TEST(Poisson, OfARoomIsAccurateToAVoxelAndFacesInwards) {
  MESH_OR_SKIP(mesh, RoomMap());
  ASSERT_GT(mesh.triangles.size(), 3000u);
  double sum = 0.0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vector v = mesh.vertices[i].cast<double>();
    sum += DistanceToRoom(v);
    EXPECT_LT(DistanceToRoom(v), kVoxel);
    EXPECT_LT(mesh.normals[i].cast<double>().dot(v), 0.0);
  }
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.size()), 0.2 * kVoxel);
}

TEST(Poisson, WhatItMakesUpFarFromAllGaussiansIsCutOff) {
  std::vector<Disc> discs;
  Tile(Vector(2.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0), Vector(0.0, 1.0, 0.0), discs);
  MESH_OR_SKIP(mesh, MapOf(discs, {At(0.0, 0.0, 0.0)}));
  ASSERT_GT(mesh.triangles.size(), 300u);
  for (const Eigen::Vector3f& v : mesh.vertices) {
    EXPECT_NEAR(v.x(), 2.0f, 2.1f * static_cast<float>(kVoxel));
    EXPECT_LT(std::max(std::abs(v.y()), std::abs(v.z())), 1.0f + 3.5f * static_cast<float>(kVoxel));
  }
}

TEST(Poisson, OfAnEmptyMapIsAnError) {
  EXPECT_EQ(PoissonOfMap(SurfelMap(), Config()).error().code, ErrorCode::kInput);
}

}  // namespace
}  // namespace covsplat::test
