#include "covsplat/sim/worlds.hpp"

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "covsplat/sim/city.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/scene.hpp"

namespace covsplat {
namespace {

constexpr int kSeed = 3;

// Worlds are large: each is built once for all tests.
const Scene& SceneOf(const WorldKind& world, int seed = kSeed) {
  static std::map<std::pair<std::string_view, int>, std::unique_ptr<const Scene>> scenes;
  auto& scene = scenes[{world.name, seed}];
  if (!scene) scene = std::make_unique<const Scene>(world.mesh(seed));
  return *scene;
}

// The city by a few of its blocks, which are enough to see that it is sound.
constexpr CityPlan kTown{.blocks_east = 2, .blocks_north = 2, .streets_north = 3};
constexpr WorldKind kTownKind{"town",
                              "a small city",
                              "vehicle",
                              [](int seed) { return MakeCity(seed, kTown); },
                              [] { return CityRoute(kTown); },
                              [](int seed) { return CityPeople(seed, kTown); }};

std::vector<WorldKind> SmallWorlds() {
  std::vector<WorldKind> worlds;
  for (const WorldKind& world : Worlds())
    worlds.push_back(world.name == "city" ? kTownKind : world);
  return worlds;
}

class EveryWorld : public testing::TestWithParam<WorldKind> {};
INSTANTIATE_TEST_SUITE_P(Worlds,
                         EveryWorld,
                         testing::ValuesIn(SmallWorlds()),
                         [](const auto& world) { return std::string(world.param.name); });

TEST_P(EveryWorld, IsMadeFromItsSeedAndNothingElse) {
  const WorldMesh& first = SceneOf(GetParam()).Mesh();
  const WorldMesh again = GetParam().mesh(kSeed);
  EXPECT_EQ(first.vertices, again.vertices);
  EXPECT_EQ(first.triangles, again.triangles);
  EXPECT_NE(first.vertices, GetParam().mesh(kSeed + 1).vertices);
}

TEST_P(EveryWorld, IsFiniteAndOfSensibleSurfaces) {
  const WorldMesh& mesh = SceneOf(GetParam()).Mesh();
  EXPECT_GT(mesh.triangles.size(), 5000u) << "a place, not a box";
  EXPECT_LT(mesh.triangles.size(), 2'000'000u);
  ASSERT_EQ(mesh.reflectivity.size(), mesh.triangles.size());
  std::size_t bad = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) bad += vertex.allFinite() ? 0 : 1;
  for (const float r : mesh.reflectivity) bad += r >= 0.0f && r <= 1.0f ? 0 : 1;
  std::size_t slivers = 0;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    const auto corner = [&](int k) { return mesh.vertices[static_cast<std::size_t>(triangle(k))]; };
    const Eigen::Vector3f normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    slivers += normal.norm() > 1e-9f ? 0 : 1;
  }
  EXPECT_EQ(bad, 0u);
  EXPECT_LT(slivers, mesh.triangles.size() / 100);
}

void ExpectClearWay(const WorldKind& world, int seed) {
  const Scene& scene = SceneOf(world, seed);
  const bool drives = world.default_motion == "vehicle";
  const float clear_m = drives ? 1.0f : 0.3f;
  const Motion motion = MakeMotion(world.default_motion, world.route(), 1, seed).value();
  const float height_m = drives ? 1.8f : (world.default_motion == "handheld" ? 1.5f : 1.7f);
  for (double time_s = 0.0; time_s < motion.Duration(); time_s += 0.1) {
    const Eigen::Vector3f position = motion.PoseAt(time_s).Translation().cast<float>();
    ASSERT_FALSE(scene.DistanceTo(position, clear_m)) << time_s << " s: " << position.transpose();
    const Eigen::Vector3f below = position - Eigen::Vector3f(0.0f, 0.0f, 0.7f);
    ASSERT_FALSE(scene.DistanceTo(below, clear_m)) << time_s << " s: " << below.transpose();
    const auto ground = scene.Cast(position, -Eigen::Vector3f::UnitZ(), 3.0f);
    ASSERT_TRUE(ground) << time_s << " s: " << position.transpose();
    ASSERT_NEAR(ground->range_m, height_m, 0.3f) << time_s << " s: " << position.transpose();
  }
}

TEST_P(EveryWorld, ItsWayKeepsClearOfEverythingWithGroundBelow) {
  for (const int seed : {1, kSeed}) ExpectClearWay(GetParam(), seed);
}

void ExpectClearMovers(const WorldKind& world, int seed) {
  const Scene& scene = SceneOf(world, seed);
  const Motion motion = MakeMotion(world.default_motion, world.route(), 1, seed).value();
  for (const Mover& mover : world.movers(seed)) {
    for (double time_s = 0.0; time_s < motion.Duration(); time_s += 0.5) {
      const SE3 T_world_mover = mover.motion.PoseAt(time_s);
      const Eigen::Vector3d waist = T_world_mover * Eigen::Vector3d(0.0, 0.0, 1.0);
      ASSERT_FALSE(scene.DistanceTo(waist.cast<float>(), 0.3f)) << waist.transpose();
      const double apart_m = (motion.PoseAt(time_s).Translation() - waist).norm();
      ASSERT_GT(apart_m, 2.0) << time_s;
    }
  }
}

TEST_P(EveryWorld, ItsMoversKeepClearOfWallsAndOfTheSensor) {
  for (const int seed : {1, kSeed}) ExpectClearMovers(GetParam(), seed);
}

TEST(Worlds, RoutesHaveTheLengthsThatTheyPromise) {
  const auto length_of = [](std::string_view name) {
    const Route route = FindWorld(name)->route();
    return Path(route.controls, route.closed).Length();
  };
  EXPECT_NEAR(length_of("college"), 130.0, 10.0);
  EXPECT_GT(length_of("street"), 600.0);
  EXPECT_NEAR(length_of("tunnel"), 260.0, 1.0);
  EXPECT_NEAR(length_of("city"), 10'630.0, 20.0);
  EXPECT_NEAR(length_of("multilevel"), 240.0, 15.0);
}

TEST(Worlds, AnUnknownNameIsAnErrorThatNamesTheKnownOnes) {
  const auto world = FindWorld("atlantis");
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message.find("courtyard"), std::string::npos);
  EXPECT_NE(world.error().message.find("multilevel"), std::string::npos);
}

TEST(Multilevel, FloorsAreAlikeToTheLastPlant) {
  const Scene& scene = SceneOf(FindWorld("multilevel").value());
  for (double azimuth = 0.0; azimuth < 6.28; azimuth += 0.01) {
    const Eigen::Vector3f ray(
        static_cast<float>(std::cos(azimuth)), static_cast<float>(std::sin(azimuth)), 0.05f);
    const auto range_at = [&](float z) {
      const auto hit = scene.Cast({3.2f, 7.0f, z}, ray.normalized(), 60.0f);
      return hit ? hit->range_m : -1.0f;
    };
    EXPECT_NEAR(range_at(1.6f), range_at(4.8f), 1e-3f) << azimuth;
  }
}

}  // namespace
}  // namespace covsplat
