#include "covsplat/sim/multilevel.hpp"

#include <numbers>
#include <utility>
#include <vector>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/buildings.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr int kFloors = 3;
constexpr float kStorey = 3.2f;
constexpr float kSlab = 0.25f;
constexpr float kEast = 24.0f;   // x from 0
constexpr float kNorth = 14.0f;  // y from 0
constexpr float kCoreWest = 6.0f;
constexpr float kCoreEast = 18.0f;
constexpr float kCoreSouth = 4.4f;
constexpr float kCoreNorth = 9.6f;
constexpr float kStairWest = 7.0f;
constexpr float kStairEast = 12.8f;
constexpr float kStairSouth = 11.8f;
constexpr float kStairNorth = 13.7f;
constexpr float kWall = 0.7f;
constexpr float kFloor = 0.45f;
constexpr float kWood = 0.35f;
constexpr float kMetal = 0.35f;
constexpr float kQuarter = 0.5f * std::numbers::pi_v<float>;

struct Rectangle {
  float west = 0.0f;
  float south = 0.0f;
  float east = 0.0f;
  float north = 0.0f;
};

void AddSlab(MeshBuilder& mesh, const Rectangle& plan, float top) {
  mesh.Box({0.5f * (plan.west + plan.east), 0.5f * (plan.south + plan.north), top - kSlab},
           {plan.east - plan.west, plan.north - plan.south, kSlab},
           0.0f,
           kFloor);
}

// With a hole where the stairs come up.
void AddFloorSlab(MeshBuilder& mesh, float top, bool with_hole) {
  if (!with_hole) return AddSlab(mesh, {0.0f, 0.0f, kEast, kNorth}, top);
  AddSlab(mesh, {0.0f, 0.0f, kEast, kStairSouth}, top);
  AddSlab(mesh, {0.0f, kStairNorth, kEast, kNorth}, top);
  AddSlab(mesh, {0.0f, kStairSouth, kStairWest, kStairNorth}, top);
  AddSlab(mesh, {kStairEast, kStairSouth, kEast, kStairNorth}, top);
}

void AddOuterWalls(MeshBuilder& mesh, float z, Rng& rng) {
  const WallSize along_x{kEast, 0.0f, kStorey - kSlab};
  const WallSize along_y{kNorth, 0.0f, kStorey - kSlab};
  const Panel south{{0.0f, 0.0f, z}, Vector3f::UnitX(), Vector3f::UnitY()};
  const Panel north{{0.0f, kNorth, z}, Vector3f::UnitX(), -Vector3f::UnitY()};
  const Panel west{{0.0f, 0.0f, z}, Vector3f::UnitY(), Vector3f::UnitX()};
  const Panel east{{kEast, 0.0f, z}, Vector3f::UnitY(), -Vector3f::UnitX()};
  AddFacade(mesh, south, along_x, {}, {1.0f, 3.2f, 7, 2.2f, 1.5f, {0.9f}}, kWall, rng);
  AddFacade(mesh, north, along_x, {}, {14.2f, 3.2f, 3, 2.2f, 1.5f, {0.9f}}, kWall, rng);
  AddFacade(mesh, west, along_y, {}, {1.2f, 4.2f, 3, 2.4f, 1.5f, {0.9f}}, kWall, rng);
  AddFacade(mesh,
            east,
            along_y,
            {Door(6.0f, 1.8f, 0.0f, 2.2f)},
            {1.0f, 4.6f, 3, 1.6f, 1.5f, {0.9f}},
            kWall,
            rng);
}

// Lifts and closed offices.
void AddCore(MeshBuilder& mesh, float z) {
  const float width = kCoreEast - kCoreWest;
  const float depth = kCoreNorth - kCoreSouth;
  const WallSize front{width, 0.0f, kStorey - kSlab};
  const WallSize side{depth, 0.0f, kStorey - kSlab};
  const Panel south{{kCoreWest, kCoreSouth, z}, Vector3f::UnitX(), -Vector3f::UnitY()};
  const Panel north{{kCoreWest, kCoreNorth, z}, Vector3f::UnitX(), Vector3f::UnitY()};
  const Panel west{{kCoreWest, kCoreSouth, z}, Vector3f::UnitY(), -Vector3f::UnitX()};
  const Panel east{{kCoreEast, kCoreSouth, z}, Vector3f::UnitY(), Vector3f::UnitX()};
  const std::vector<Opening> lifts = {
      Door(1.2f, 1.2f, 0.0f, 2.2f), Door(3.2f, 1.2f, 0.0f, 2.2f), Door(8.4f, 1.0f, 0.0f, 2.1f)};
  const std::vector<Opening> offices = {Door(2.0f, 1.0f, 0.0f, 2.1f), Door(9.6f, 1.0f, 0.0f, 2.1f)};
  mesh.Wall(south, front.width, front.z_low, front.z_high, lifts, kWall);
  mesh.Wall(north, front.width, front.z_low, front.z_high, offices, kWall);
  mesh.Wall(west, side.width, side.z_low, side.z_high, {Door(2.0f, 1.0f, 0.0f, 2.1f)}, kWall);
  mesh.Wall(east, side.width, side.z_low, side.z_high, {}, kWall);
  mesh.Box(east.At(2.6f, 1.1f, -0.03f), {2.0f, 0.06f, 1.0f}, kQuarter, kWood);  // a notice board
}

void AddFlight(MeshBuilder& mesh, float z) {
  constexpr int kSteps = 20;
  const Stairs stairs{kSteps,
                      kStorey / kSteps,
                      (kStairEast - kStairWest) / kSteps,
                      kStairNorth - kStairSouth - 0.1f,
                      0.3f};
  AddStairs(
      mesh, {{kStairWest, kStairNorth, z}, Vector3f::UnitX(), -Vector3f::UnitY()}, stairs, kFloor);
}

void Furnish(MeshBuilder& mesh, float z, Rng& rng) {
  for (const float x : {5.0f, 12.0f, 19.0f}) {
    mesh.Cylinder({x, 0.6f, z}, 0.22f, 0.22f, kStorey - kSlab, 14, kWall);
  }
  mesh.Box({23.2f, 11.8f, z}, {0.9f, 2.4f, 0.75f}, 0.0f, kWood);  // a desk
  mesh.Box({22.3f, 11.8f, z}, {0.5f, 0.5f, 0.9f}, 0.3f, kWood);
  AddBench(mesh, {9.0f, 0.5f, z}, 2.0f * kQuarter);
  AddBench(mesh, {0.5f, 7.6f, z}, kQuarter);
  for (const Vector3f& pot : {Vector3f(0.8f, 0.9f, z), Vector3f(22.9f, 0.9f, z)}) {
    mesh.Cylinder(pot, 0.25f, 0.32f, 0.5f, 12, kFloor);
    AddHedge(mesh, pot + Vector3f(0.0f, 0.0f, 0.5f), {0.6f, 0.6f, 1.1f}, 0.0f, rng);
  }
  for (float x = 2.0f; x < kEast; x += 4.0f) {  // lights under the ceiling
    mesh.Box({x, 2.2f, z + kStorey - kSlab - 0.1f}, {1.4f, 0.3f, 0.08f}, 0.0f, 0.9f);
  }
  mesh.Cylinder({17.0f, 9.85f, z + 0.3f}, 0.1f, 0.1f, 0.5f, 10, kMetal);  // an extinguisher
}

// Where nothing goes up any more, a railing guards the hole.
void GuardLastHole(MeshBuilder& mesh, float z) {
  AddRailing(mesh, {kStairWest, kStairSouth, z}, {kStairEast, kStairSouth, z}, 1.0f, kMetal);
  AddRailing(mesh, {kStairWest, kStairSouth, z}, {kStairWest, kStairNorth, z}, 1.0f, kMetal);
}

double HeightOf(int floor) { return static_cast<double>(kStorey) * floor; }

}  // namespace

WorldMesh MakeMultilevel(int seed) {
  MeshBuilder mesh;
  for (int floor = 0; floor < kFloors; ++floor) {
    Rng rng(static_cast<std::uint64_t>(seed));  // the same for every floor
    const float z = kStorey * static_cast<float>(floor);
    AddFloorSlab(mesh, z, floor > 0);
    AddOuterWalls(mesh, z, rng);
    AddCore(mesh, z);
    Furnish(mesh, z, rng);
    if (floor + 1 < kFloors) AddFlight(mesh, z);
  }
  AddFloorSlab(mesh, kStorey * kFloors, false);
  GuardLastHole(mesh, kStorey * (kFloors - 1));
  return std::move(mesh).Take();
}

Route MultilevelRoute() {
  constexpr double kStairY = 12.7;
  std::vector<Eigen::Vector3d> corners;
  const auto go = [&](int floor, const std::vector<Eigen::Vector2d>& way) {
    for (const Eigen::Vector2d& at : way) corners.emplace_back(at.x(), at.y(), HeightOf(floor));
  };
  const std::vector<Eigen::Vector2d> round = {{12.8, kStairY},
                                              {15.5, 12.5},
                                              {20.6, 10.8},
                                              {20.8, 3.4},
                                              {17.5, 2.3},
                                              {4.5, 2.3},
                                              {3.2, 4.0},
                                              {3.2, 10.8},
                                              {4.8, kStairY},
                                              {7.0, kStairY}};
  const std::vector<Eigen::Vector2d> round_back(round.rbegin(), round.rend());
  go(0, {{12.0, 2.3}, {4.5, 2.3}, {3.2, 4.0}, {3.2, 10.8}, {4.8, kStairY}, {7.0, kStairY}});
  go(1, round);
  go(2,
     {{12.8, kStairY},
      {15.5, 12.5},
      {20.6, 10.8},
      {20.8, 3.4},
      {17.5, 2.3},
      {4.5, 2.3},
      {3.2, 4.0},
      {3.2, 9.4},
      {4.6, 10.7},
      {14.8, 10.7},
      {16.2, 11.7},
      {15.2, kStairY},
      {12.8, kStairY}});
  go(1, round_back);
  go(0,
     {{7.0, kStairY},
      {4.8, kStairY},
      {3.4, 11.7},
      {4.8, 10.7},
      {19.0, 10.7},
      {20.8, 9.0},
      {20.8, 3.8},
      {19.3, 2.3}});
  Route route;
  route.controls = AlongLines(corners, true, 1.0);
  return route;
}

}  // namespace covsplat
