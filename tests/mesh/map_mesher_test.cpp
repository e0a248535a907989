// Maps whose surface is known, seen from where a sensor would have been.
#include "covsplat/mesh/map_mesher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/mesh/mesh_checks.hpp"
#include "tests/mesh/room_map.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kVoxel = 0.1;

SensorModel Sensor() { return UniformSensorModel(64, 512, -0.7, 0.7, 0.3, 40.0); }

MeshConfig Config() {
  MeshConfig config;
  config.voxel_m = kVoxel;
  config.threads = 1;
  config.view.columns = 512;
  return config;
}

Result<MeshResult> Mesh(const SurfelMap& map,
                        const MeshConfig& config,
                        const SensorModel& sensor = Sensor()) {
  return MeshOfMap(map, map.T_map_keyframe, sensor, Backend::kCpu, RasterConfig(), config, nullptr);
}

TEST(MapMesher, ARoomIsAccurateToAFifthOfAVoxelAndItsEdgesStaySharp) {
  MeshConfig config = Config();
  config.surfel_weight = 0.1;  // discs reach a little past the edges of their walls
  const MeshResult result = Mesh(RoomMap(), config).value();
  const TriangleMesh& mesh = result.mesh;
  ASSERT_GT(mesh.triangles.size(), 3000u);
  std::vector<double> distances;
  double corner = 1.0;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    distances.push_back(DistanceToRoom(v.cast<double>()));
    corner = std::min(corner, (v.cast<double>() - Vector(2.0, 1.5, 0.0)).head<2>().norm());
  }
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.02 * kVoxel);
  EXPECT_LT(distances[distances.size() * 99 / 100], 0.2 * kVoxel);
  EXPECT_LT(corner, 0.2 * kVoxel);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_LT(mesh.normals[i].dot(mesh.vertices[i]), 0.0f);  // into the room
  }
}

TEST(MapMesher, DiscsOfARoomBlurItsEdgesByLittleMoreThanHalfAVoxel) {
  const TriangleMesh mesh = Mesh(RoomMap(), Config()).value().mesh;
  std::vector<double> distances;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    distances.push_back(DistanceToRoom(v.cast<double>()));
  }
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.02 * kVoxel);
  EXPECT_LT(distances[distances.size() * 99 / 100], 0.6 * kVoxel);
}

TEST(MapMesher, ThreadsAndTilesLeaveNoTrace) {
  const SurfelMap map = RoomMap();
  const MeshResult whole = Mesh(map, Config()).value();
  MeshConfig config = Config();
  config.threads = 2;
  config.max_tile_blocks = 64;
  const MeshResult tiled = Mesh(map, config).value();
  EXPECT_EQ(whole.tiles, 1u);
  EXPECT_GT(tiled.tiles, 2u);
  EXPECT_EQ(whole.mesh.vertices, tiled.mesh.vertices);
  EXPECT_EQ(whole.mesh.normals, tiled.mesh.normals);
  EXPECT_EQ(whole.mesh.triangles, tiled.mesh.triangles);
}

TEST(MapMesher, AThinWallSeenFromBothSidesNeitherVanishesNorThickens) {
  constexpr double kHalf = 0.1;  // two voxels thick
  std::vector<Disc> discs;
  const Vector y(0.0, 2.0, 0.0), z(0.0, 0.0, 1.5);
  Tile(Vector(kHalf, 0.0, 0.0), y, z, discs);
  Tile(Vector(-kHalf, 0.0, 0.0), z, y, discs);
  const SurfelMap map = MapOf(
      discs, {At(2.0, 0.5, 0.0), At(2.0, -0.5, 0.0), At(-2.0, 0.5, 0.0), At(-2.0, -0.5, 0.0)});
  const TriangleMesh mesh = Mesh(map, Config()).value().mesh;
  std::array<std::size_t, 2> side{};
  for (const Eigen::Vector3f& v : mesh.vertices) {
    if (std::abs(v.y()) > 1.8f || std::abs(v.z()) > 1.3f) continue;  // the rim
    EXPECT_NEAR(std::abs(v.x()), kHalf, 0.25 * kVoxel);
    ++side[v.x() > 0.0f];
  }
  EXPECT_GT(side[0], 800u);
  EXPECT_GT(side[1], 800u);
}

/// A wall at x = 2 whose discs lie beyond `half_gap_m` to either side of y = 0.
SurfelMap WallWithGap(double half_gap_m) {
  std::vector<Disc> discs;
  const Vector y(0.0, 0.5, 0.0), z(0.0, 0.0, 0.5);
  Tile(Vector(2.0, 0.5 + half_gap_m, 0.0), z, y, discs);
  Tile(Vector(2.0, -0.5 - half_gap_m, 0.0), z, y, discs);
  return MapOf(discs, {At(0.0, 0.0, 0.0)});
}

TEST(MapMesher, GapsAsWideAsTheBridgeAreClosedWiderOnesStayOpen) {
  const auto in_gap = [](const MeshConfig& config, double half_gap_m) {
    const TriangleMesh mesh = Mesh(WallWithGap(half_gap_m), config).value().mesh;
    return std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3f& v) {
      return std::abs(v.y()) < 0.06f && std::abs(v.z()) < 0.3f &&
             std::abs(v.x() - 2.0f) < 0.1f * static_cast<float>(kVoxel);
    });
  };
  MeshConfig config = Config();
  EXPECT_GE(in_gap(config, 0.3), 5);
  EXPECT_EQ(in_gap(config, 0.7), 0);
  config.bridge_voxels = 0.0;
  EXPECT_EQ(in_gap(config, 0.3), 0);
}

TEST(MapMesher, RimsOfASurfaceDoNotGrow) {
  MeshConfig config = Config();
  const auto farthest = [&] {
    const TriangleMesh mesh = Mesh(WallWithGap(0.0), config).value().mesh;
    float y = 0.0f;
    for (const Eigen::Vector3f& v : mesh.vertices) y = std::max(y, std::abs(v.y()));
    return y;
  };
  const float bridging = farthest();
  EXPECT_LT(bridging, 1.0f + static_cast<float>(kVoxel));
  config.bridge_voxels = 0.0;
  EXPECT_LT(bridging - farthest(), 1.5f * static_cast<float>(kVoxel));
}

TEST(MapMesher, WhatNoViewShowsWellIsKnownFromItsGaussians) {
  // A wall that the only view may not look as far as.
  std::vector<Disc> discs;
  Tile(Vector(5.0, 0.0, 0.0), Vector(0.0, 0.0, 1.0), Vector(0.0, 1.0, 0.0), discs);
  const SurfelMap map = MapOf(discs, {At(0.0, 0.0, 0.0)});
  MeshConfig config = Config();
  config.view.max_range_m = 3.0;
  const Result<MeshResult> known = Mesh(map, config);
  ASSERT_TRUE(known) << known.error().message;
  ASSERT_GT(known->mesh.vertices.size(), 400u);
  for (std::size_t i = 0; i < known->mesh.vertices.size(); ++i) {
    EXPECT_NEAR(known->mesh.vertices[i].x(), 5.0f, 0.1f * static_cast<float>(kVoxel));
    EXPECT_LT(known->mesh.normals[i].x(), -0.9f);
  }
  config.surfel_weight = 0.0;
  EXPECT_FALSE(Mesh(map, config));
}

TEST(MapMesher, FarFromTheOriginIsAsAccurateAsNear) {
  std::vector<Disc> discs = Room();
  const Vector far(900.0, -700.0, 30.0);
  for (Disc& disc : discs) disc.mean += far;
  const SurfelMap map =
      MapOf(discs, {At(far.x(), far.y(), far.z()), At(far.x() + 1.0, far.y(), far.z())});
  const TriangleMesh mesh = Mesh(map, Config()).value().mesh;
  std::vector<double> distances;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    distances.push_back(DistanceToRoom(v.cast<double>() - far));
  }
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.02 * kVoxel);
}

TEST(MapMesher, MapsWithoutSurfaceAreErrorsThatSaySo) {
  const auto empty = Mesh(MapOf({}, {At(0.0, 0.0, 0.0)}), Config());
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, ErrorCode::kInput);
  // One disc that faces away from the only keyframe.
  const auto hidden =
      Mesh(MapOf({{Vector(2.0, 0.0, 0.0), Vector::UnitX()}}, {At(0.0, 0.0, 0.0)}), Config());
  ASSERT_FALSE(hidden);
  EXPECT_NE(hidden.error().message.find("no surface"), std::string::npos);
  // One that is too far away for the numbering of voxels.
  const auto far =
      Mesh(MapOf({{Vector(1e6, 0.0, 0.0), Vector::UnitX()}}, {At(0.0, 0.0, 0.0)}), Config());
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::kUsage);
}

TEST(MapMesher, StopsWhenAsked) {
  const auto stop = [](const MeshProgress& progress) { return progress.done < 2; };
  const SurfelMap map = RoomMap();
  const MeshResult result =
      MeshOfMap(map, map.T_map_keyframe, Sensor(), Backend::kCpu, RasterConfig(), Config(), stop)
          .value();
  EXPECT_TRUE(result.interrupted);
  EXPECT_TRUE(result.mesh.triangles.empty());
}

TEST(SurfelMap, BrokenGaussiansAreDroppedAndCounted) {
  SurfelMap map = MapOf(Room(), {At(0.0, 0.0, 0.0)});
  const std::size_t size = map.Size();
  map.gaussians.Column(kMeanY)[3] = std::numeric_limits<float>::quiet_NaN();
  map.gaussians.Column(kLogScaleU)[7] = std::numeric_limits<float>::infinity();
  for (int p = kQuatW; p <= kQuatZ; ++p) map.gaussians.Column(p)[9] = 0.0f;
  EXPECT_EQ(DropBroken(map), 3u);
  EXPECT_EQ(map.Size(), size - 3);
  EXPECT_EQ(map.keyframe.size(), size - 3);
  EXPECT_EQ(map.confidence.size(), size - 3);
  EXPECT_TRUE(Mesh(map, Config()));
}

TEST(SurfelMap, ViewsAreKeyframesAndThenScansThatAreFarFromAllOfThem) {
  const SurfelMap map = MapOf({}, {At(0.0, 0.0, 0.0), At(5.0, 0.0, 0.0)});
  Trajectory path;
  for (int i = 0; i <= 50; ++i) path.push_back({0.1 * i, At(0.1 * i, 0.0, 0.0)});
  const std::vector<SE3> views = ChooseViews(map, path, 1.0);
  ASSERT_EQ(views.size(), 6u);
  EXPECT_NEAR(views[2].Translation().x(), 1.0, 1e-9);
  EXPECT_NEAR(views[5].Translation().x(), 4.0, 1e-9);
}

}  // namespace
}  // namespace covsplat::test
