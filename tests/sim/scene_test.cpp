#include "covsplat/sim/scene.hpp"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kFloatRange = 1e-5f;  // single precision at a few metres

Scene FloorAt(float z) {
  MeshBuilder mesh;
  mesh.Quad({-50.0f, -50.0f, z}, {50.0f, -50.0f, z}, {50.0f, 50.0f, z}, {-50.0f, 50.0f, z}, 0.4f);
  return Scene(std::move(mesh).Take());
}

Scene UnitBoxAround(const Vector3f& centre) {
  MeshBuilder mesh;
  mesh.Box(centre - Vector3f(0.0f, 0.0f, 0.5f), Vector3f::Ones(), 0.0f, 0.7f);
  return Scene(std::move(mesh).Take());
}

Vector3f RandomDirection(Rng& rng) {
  return Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal()).normalized().cast<float>();
}

TEST(Scene, RaysMeetAPlaneAtItsExactRange) {
  const Scene scene = FloorAt(-1.5f);
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3f direction = RandomDirection(rng);
    if (direction.z() > -0.1f) continue;
    const auto hit = scene.Cast(Vector3f::Zero(), direction, 100.0f);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->range_m, -1.5f / direction.z(), kFloatRange * hit->range_m);
    EXPECT_NEAR(hit->normal.z(), 1.0f, kFloatRange);
    EXPECT_FLOAT_EQ(hit->reflectivity, 0.4f);
  }
}

TEST(Scene, RaysFromInsideABoxMeetItsNearestFace) {
  const Scene scene = UnitBoxAround(Vector3f::Zero());
  Rng rng(2);
  for (int i = 0; i < 1000; ++i) {
    const Vector3f direction = RandomDirection(rng);
    const auto hit = scene.Cast(Vector3f::Zero(), direction, 10.0f);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->range_m, 0.5f / direction.cwiseAbs().maxCoeff(), kFloatRange);
    EXPECT_LT(hit->normal.dot(direction), 0.0f);
    EXPECT_NEAR(hit->normal.norm(), 1.0f, kFloatRange);
  }
}

TEST(Scene, NormalsFaceTheRayFromEitherSide) {
  const Scene scene = FloorAt(0.0f);
  const auto from_above = scene.Cast({1.0f, 2.0f, 3.0f}, -Vector3f::UnitZ(), 10.0f);
  const auto from_below = scene.Cast({1.0f, 2.0f, -3.0f}, Vector3f::UnitZ(), 10.0f);
  EXPECT_EQ(from_above->normal, Vector3f(0.0f, 0.0f, 1.0f));
  EXPECT_EQ(from_below->normal, Vector3f(0.0f, 0.0f, -1.0f));
}

TEST(Scene, NothingIsHitBeyondTheMaximumRange) {
  const Scene scene = FloorAt(0.0f);
  EXPECT_FALSE(scene.Cast({0.0f, 0.0f, 3.0f}, -Vector3f::UnitZ(), 2.9f));
  EXPECT_FALSE(scene.Cast({0.0f, 0.0f, 3.0f}, Vector3f::UnitZ(), 1000.0f));
}

TEST(Scene, DistanceIsThatOfTheNearestPointOfAnyTriangle) {
  const Scene scene = UnitBoxAround(Vector3f::Zero());
  EXPECT_NEAR(*scene.DistanceTo({0.0f, 0.0f, 2.0f}, 5.0f), 1.5f, kFloatRange);             // face
  EXPECT_NEAR(*scene.DistanceTo({1.5f, 1.5f, 0.1f}, 5.0f), std::sqrt(2.0f), kFloatRange);  // edge
  EXPECT_NEAR(*scene.DistanceTo({1.5f, 1.5f, 1.5f}, 5.0f), std::sqrt(3.0f), kFloatRange);  // corner
  EXPECT_NEAR(*scene.DistanceTo({0.4f, 0.0f, 0.0f}, 5.0f), 0.1f, kFloatRange);             // inside
  EXPECT_FALSE(scene.DistanceTo({0.0f, 0.0f, 2.0f}, 1.4f));
}

TEST(Scene, KeepsItsTrianglesWhenMoved) {
  Scene first = FloorAt(0.0f);
  const Scene second = std::move(first);
  EXPECT_EQ(second.Mesh().triangles.size(), 2u);
  EXPECT_TRUE(second.Cast({0.0f, 0.0f, 3.0f}, -Vector3f::UnitZ(), 10.0f));
}

TEST(MeshBuilder, RoundShapesHaveTheirRadii) {
  MeshBuilder mesh;
  mesh.Ellipsoid({1.0f, 2.0f, 3.0f}, {1.0f, 2.0f, 3.0f}, 2, 0.5f);
  const WorldMesh ellipsoid = std::move(mesh).Take();
  EXPECT_EQ(ellipsoid.triangles.size(), 20u * 16u);
  for (const Vector3f& vertex : ellipsoid.vertices) {
    const Vector3f scaled =
        (vertex - Vector3f(1.0f, 2.0f, 3.0f)).cwiseQuotient(Vector3f(1.0f, 2.0f, 3.0f));
    EXPECT_NEAR(scaled.norm(), 1.0f, kFloatRange);
  }
  MeshBuilder other;
  other.Cylinder(Vector3f::Zero(), 2.0f, 1.0f, 4.0f, 64, 0.5f);
  const Scene cone(std::move(other).Take());
  // A polygon of 64 sides lies within r (1 - cos(pi / 64)) of the circle.
  EXPECT_NEAR(cone.Cast({10.0f, 0.01f, 2.0f}, -Vector3f::UnitX(), 20.0f)->range_m, 8.5f, 2e-3f);
  EXPECT_NEAR(cone.Cast({0.1f, 0.1f, 9.0f}, -Vector3f::UnitZ(), 20.0f)->range_m, 5.0f, kFloatRange);
}

TEST(MeshBuilder, AnOpeningWithoutDepthIsNothingButAHole) {
  const Panel panel{Vector3f::Zero(), Vector3f::UnitX(), -Vector3f::UnitY()};
  MeshBuilder mesh;
  mesh.Wall(panel, 3.0f, 0.0f, 3.0f, {{1.0f, 2.0f, 1.0f, 2.0f, 0.0f, true, 0.1f}}, 0.8f);
  const WorldMesh wall = std::move(mesh).Take();
  EXPECT_EQ(wall.triangles.size(), 2u * 8u);  // nine cells but one
}

TEST(MeshBuilder, WallsHaveHolesWhereTheirOpeningsAre) {
  const Panel panel{Vector3f::Zero(), Vector3f::UnitX(), -Vector3f::UnitY()};
  MeshBuilder mesh;
  const Opening niche{1.0f, 2.0f, 1.0f, 2.0f, 0.2f, false, 0.1f};
  const Opening passage{3.0f, 4.0f, 0.0f, 2.0f, 1.0f, true, 0.1f};
  mesh.Wall(panel, 6.0f, 0.0f, 3.0f, {niche, passage}, 0.8f);
  const Scene scene(std::move(mesh).Take());
  const auto range_at = [&](float u, float z) {
    const auto hit = scene.Cast({u, -5.0f, z}, Vector3f::UnitY(), 100.0f);
    return hit ? hit->range_m : -1.0f;
  };
  EXPECT_NEAR(range_at(0.5f, 1.5f), 5.0f, kFloatRange);
  EXPECT_NEAR(range_at(1.5f, 1.4f), 5.2f, kFloatRange);
  EXPECT_NEAR(range_at(5.5f, 2.5f), 5.0f, kFloatRange);
  EXPECT_EQ(range_at(3.5f, 1.0f), -1.0f);
}

}  // namespace
}  // namespace covsplat
