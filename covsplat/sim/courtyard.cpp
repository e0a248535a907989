#include "covsplat/sim/courtyard.hpp"

#include <cmath>
#include <numbers>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPaving = 0.5f;
constexpr float kGrass = 0.35f;
constexpr float kStone = 0.6f;
constexpr float kPlaster = 0.7f;
constexpr float kBrick = 0.4f;
constexpr float kTiles = 0.3f;
constexpr float kDoor = 0.25f;
constexpr float kFoundation = -0.6f;  // walls begin below the lowest ground
constexpr float kArcadeY = 9.0f;
constexpr float kPassageDepth = 8.0f;

float Ground(float x, float y) { return static_cast<float>(CourtyardGround(x, y)); }

Vector3f OnGround(float x, float y) { return {x, y, Ground(x, y)}; }

Panel SouthWall() { return {{-15.0f, -12.0f, 0.0f}, Vector3f::UnitX(), Vector3f::UnitY()}; }
Panel EastWall() { return {{15.0f, -12.0f, 0.0f}, Vector3f::UnitY(), -Vector3f::UnitX()}; }
Panel NorthWall() { return {{-15.0f, 12.0f, 0.0f}, Vector3f::UnitX(), -Vector3f::UnitY()}; }
Panel WestWall() { return {{-15.0f, -12.0f, 0.0f}, Vector3f::UnitY(), Vector3f::UnitX()}; }
Panel ArcadeFront() { return {{-15.0f, kArcadeY, 0.0f}, Vector3f::UnitX(), -Vector3f::UnitY()}; }

Opening Door(float u, float width, float z, float height) {
  return {u, u + width, z, z + height, 0.45f, false, kDoor};
}

// A wall with doors and, between them, windows.
void AddFacade(MeshBuilder& mesh,
               const Panel& panel,
               const Vector2f& width_and_height,
               const std::vector<Opening>& doors,
               const WindowGrid& grid,
               float reflectivity,
               Rng& rng) {
  const std::vector<Opening> windows = MakeWindows(grid, doors, rng);
  std::vector<Opening> openings = doors;
  openings.insert(openings.end(), windows.begin(), windows.end());
  mesh.Wall(panel, width_and_height.x(), kFoundation, width_and_height.y(), openings, reflectivity);
  AddWindowFrames(mesh, panel, windows);
}

// Rises by `rise` over `run` behind the top of a wall, with eaves 0.5 m in front of it.
void AddRoof(
    MeshBuilder& mesh, const Panel& panel, float width, float eaves, float run, float rise) {
  const float drop = 0.5f * rise / run;
  mesh.Quad(panel.At(0.0f, eaves - drop, -0.5f),
            panel.At(width, eaves - drop, -0.5f),
            panel.At(width, eaves + rise, run),
            panel.At(0.0f, eaves + rise, run),
            kTiles);
}

void AddSouthSide(MeshBuilder& mesh, Rng& rng) {
  const Panel panel = SouthWall();
  AddFacade(mesh,
            panel,
            {30.0f, 9.0f},
            {Door(5.6f, 1.4f, -0.2f, 2.6f), Door(21.0f, 2.2f, -0.2f, 3.0f)},
            {1.6f, 2.9f, 10, 1.2f, 1.7f, {1.1f, 4.0f, 6.8f}},
            kBrick,
            rng);
  mesh.Box(panel.At(15.0f, 3.55f, 0.0f), {30.0f, 0.2f, 0.16f}, 0.0f, kStone);  // string course
  for (const float u : {3.6f, 9.5f, 15.2f, 26.7f}) {  // buttresses, stepped back half way up
    mesh.Box(panel.At(u, kFoundation, -0.35f), {0.7f, 0.7f, 3.6f}, 0.0f, kStone);
    mesh.Box(panel.At(u, 3.0f, -0.2f), {0.6f, 0.4f, 3.2f}, 0.0f, kStone);
  }
  AddRoof(mesh, panel, 30.0f, 9.0f, 6.0f, 4.2f);
  for (const float u : {7.0f, 17.5f}) {  // dormers
    mesh.Box(panel.At(u, 9.3f, 1.6f), {1.6f, 1.8f, 2.0f}, 0.0f, kPlaster);
  }
  mesh.Box(panel.At(25.0f, 11.0f, 4.0f), {0.9f, 0.7f, 4.0f}, 0.0f, kBrick);  // chimney
}

void AddNorthSide(MeshBuilder& mesh, Rng& rng) {
  AddFacade(mesh,
            NorthWall(),
            {30.0f, 11.0f},
            {Door(4.0f, 1.2f, -0.2f, 2.4f),
             Door(14.2f, 1.8f, -0.2f, 2.8f),
             Door(24.5f, 1.2f, -0.2f, 2.4f)},
            {1.0f, 3.3f, 9, 1.3f, 1.9f, {1.0f, 5.6f, 8.4f}},
            kPlaster,
            rng);
  const Panel front = ArcadeFront();
  constexpr float kBay = 3.0f;
  constexpr float kPier = 0.3f;  // half the width of the masonry between two arches
  constexpr float kSpring = 2.35f;
  constexpr float kTop = 4.1f;
  for (int bay = 0; bay < 10; ++bay) {
    const float u = kBay * static_cast<float>(bay);
    mesh.Arch(front, u + kPier, u + kBay - kPier, kSpring, kTop, 0.5f, kStone);
    for (const float depth : {0.0f, 0.5f}) {
      for (const float flank : {u, u + kBay - kPier}) {
        mesh.Quad(front.At(flank, kSpring, depth),
                  front.At(flank + kPier, kSpring, depth),
                  front.At(flank + kPier, kTop, depth),
                  front.At(flank, kTop, depth),
                  kStone);
      }
    }
    if (bay == 0) continue;
    const Vector3f foot = front.At(u, 0.0f, 0.25f);
    const Vector3f base = OnGround(foot.x(), foot.y());
    mesh.Box(base - Vector3f(0.0f, 0.0f, 0.2f), {0.66f, 0.66f, 0.5f}, 0.0f, kStone);
    mesh.Cylinder(base, 0.24f, 0.20f, kSpring - 0.2f - base.z(), 20, kStone);
    mesh.Box(front.At(u, kSpring - 0.25f, 0.25f), {0.62f, 0.62f, 0.25f}, 0.0f, kStone);
  }
  // Lean-to roof over the arcade.
  mesh.Quad(front.At(0.0f, 3.95f, -0.4f),
            front.At(30.0f, 3.95f, -0.4f),
            front.At(30.0f, 5.2f, 3.0f),
            front.At(0.0f, 5.2f, 3.0f),
            kTiles);
}

void AddStairs(MeshBuilder& mesh) {
  constexpr float kLeft = 12.7f;
  constexpr float kWidth = 15.0f - kLeft;
  constexpr float kRise = 0.17f;
  constexpr float kRun = 0.31f;
  const float x = kLeft + 0.5f * kWidth;
  const float floor_z = Ground(x, 0.0f);
  float y = 0.4f;
  float z = floor_z;
  for (int step = 0; step < 10; ++step, y += kRun) {
    z += kRise;
    mesh.Box({x, y, kFoundation}, {kWidth, kRun, z - kFoundation}, 0.0f, kStone);
    mesh.Box({kLeft - 0.1f, y, kFoundation}, {0.2f, kRun, z + 0.5f - kFoundation}, 0.0f, kStone);
  }
  mesh.Box({x, y + 1.0f, kFoundation}, {kWidth, 2.31f, z - kFoundation}, 0.0f, kStone);
  mesh.Box(
      {kLeft - 0.1f, y + 1.0f, kFoundation}, {0.2f, 2.31f, z + 0.9f - kFoundation}, 0.0f, kStone);
}

void AddEastSide(MeshBuilder& mesh, Rng& rng) {
  const Panel panel = EastWall();
  AddFacade(mesh,
            panel,
            {24.0f, 12.0f},
            {Door(3.0f, 1.6f, -0.2f, 2.7f), Door(15.8f, 1.3f, 1.65f, 2.4f)},
            {1.2f, 3.7f, 6, 1.5f, 2.2f, {1.2f, 4.8f, 8.4f}},
            kPlaster,
            rng);
  mesh.Box(panel.At(12.0f, 11.6f, -0.15f),
           {24.0f, 0.3f, 0.4f},
           0.5f * std::numbers::pi_v<float>,
           kStone);  // cornice
  AddStairs(mesh);
  // A round stair tower with a pointed roof in the south-eastern corner.
  const Vector3f tower(14.6f, -11.6f, kFoundation);
  mesh.Cylinder(tower, 2.2f, 2.2f, 14.6f, 10, kBrick);
  mesh.Cylinder(tower + Vector3f(0.0f, 0.0f, 14.6f), 2.6f, 0.05f, 4.0f, 10, kTiles);
}

// A low part, and a higher one with the passage.
void AddWestSide(MeshBuilder& mesh, Rng& rng) {
  constexpr float kLowWidth = 13.0f;
  const Panel low = WestWall();
  AddFacade(mesh,
            low,
            {kLowWidth, 8.0f},
            {Door(2.6f, 1.3f, -0.2f, 2.5f)},
            {1.0f, 2.6f, 5, 1.1f, 1.5f, {1.2f, 5.2f}},
            kStone,
            rng);
  AddRoof(mesh, low, kLowWidth, 8.0f, 4.5f, 4.0f);
  mesh.Box(low.At(7.9f, 3.1f, -0.45f), {0.9f, 2.2f, 3.4f}, 0.0f, kPlaster);  // an oriel
  const Panel high{low.At(kLowWidth, 0.0f), low.along, low.outward};
  AddFacade(mesh,
            high,
            {11.0f, 10.7f},
            {{0.6f, 4.4f, kFoundation, 3.7f, kPassageDepth, true, 0.0f}},
            {1.2f, 2.9f, 3, 1.2f, 1.8f, {1.3f, 4.9f, 8.0f}},
            kPlaster,
            rng);
  mesh.Quad(high.At(0.0f, 6.0f),
            high.At(0.0f, 10.7f),
            high.At(0.0f, 10.7f, 6.0f),
            high.At(0.0f, 6.0f, 6.0f),
            kPlaster);  // its flank above the low roof
}

// What the passage shows: a street with cars and the house across.
void AddStreet(MeshBuilder& mesh, Rng& rng) {
  const Panel house{{-40.0f, -20.0f, 0.0f}, Vector3f::UnitY(), Vector3f::UnitX()};
  AddFacade(mesh,
            house,
            {40.0f, 11.0f},
            {Door(22.0f, 1.6f, -0.3f, 2.8f)},
            {1.5f, 2.8f, 13, 1.3f, 1.7f, {1.0f, 4.2f, 7.4f}},
            kBrick,
            rng);
  AddParkedCar(mesh, OnGround(-35.5f, 1.0f), 1.55f);
  AddParkedCar(mesh, OnGround(-35.4f, 7.2f), 1.6f);
  AddTree(mesh, OnGround(-28.5f, 4.6f), 6.0f, 1.7f, rng);
  AddLampPost(mesh, OnGround(-25.5f, 1.5f), 4.5f);
}

struct Lawn {
  Vector2f low;
  Vector2f high;
};

void AddLawn(MeshBuilder& mesh, const Lawn& lawn, Rng& rng) {
  const auto height = [&](float x, float y) {
    return Ground(x, y) + 0.09f + static_cast<float>(0.012 * rng.Normal());
  };
  mesh.HeightField(lawn.low, lawn.high, 0.2f, height, [](float, float) { return kGrass; });
  const Vector2f middle = 0.5f * (lawn.low + lawn.high);
  const Vector2f size = lawn.high - lawn.low;
  constexpr float kKerb = 0.14f;
  constexpr int kStones = 6;  // per edge, so that kerbs follow the ground
  for (int i = 0; i < kStones; ++i) {
    const float s = (static_cast<float>(i) + 0.5f) / kStones - 0.5f;
    for (const float side : {-0.5f, 0.5f}) {
      const float x = middle.x() + s * size.x();
      const float y = middle.y() + s * size.y();
      const float edge_x = middle.x() + side * size.x();
      const float edge_y = middle.y() + side * size.y();
      mesh.Box(
          {x, edge_y, Ground(x, edge_y) - 0.1f}, {size.x() / kStones, kKerb, 0.24f}, 0.0f, kStone);
      mesh.Box(
          {edge_x, y, Ground(edge_x, y) - 0.1f}, {kKerb, size.y() / kStones, 0.24f}, 0.0f, kStone);
    }
  }
}

void AddGround(MeshBuilder& mesh, Rng& rng) {
  const auto paving = [](float x, float y) {
    const auto stone = static_cast<int>(std::floor(x / 1.2f) + 7.0f * std::floor(y / 1.2f));
    return kPaving + 0.02f * static_cast<float>(stone % 5);
  };
  mesh.HeightField({-45.0f, -20.0f}, {-15.0f, 20.0f}, 1.0f, Ground, paving);
  mesh.HeightField({-15.0f, -12.0f}, {15.0f, 12.0f}, 0.4f, Ground, paving);
  AddLawn(mesh, {{-8.8f, -5.2f}, {-2.2f, 5.4f}}, rng);
  AddLawn(mesh, {{5.6f, -5.6f}, {9.2f, 3.4f}}, rng);
}

void AddFurniture(MeshBuilder& mesh, Rng& rng) {
  AddFountain(mesh, OnGround(1.8f, -0.8f));
  AddTree(mesh, OnGround(-6.6f, 2.9f), 6.2f, 2.1f, rng);
  AddTree(mesh, OnGround(-4.3f, -2.6f), 5.2f, 1.8f, rng);
  AddTree(mesh, OnGround(7.6f, -3.4f), 5.6f, 1.6f, rng);
  AddTree(mesh, OnGround(7.0f, 1.6f), 4.2f, 1.2f, rng);
  AddHedge(mesh, OnGround(-8.1f, -2.2f), {0.8f, 4.2f, 1.1f}, 0.0f, rng);
  AddHedge(mesh, OnGround(0.5f, 6.2f), {3.0f, 0.7f, 0.9f}, 0.2f, rng);
  AddBench(mesh, OnGround(-1.4f, -3.4f), 1.57f);
  AddBench(mesh, OnGround(4.9f, 1.4f), -1.57f);
  AddBench(mesh, OnGround(-13.9f, -6.0f), 1.57f);
  AddBench(mesh, OnGround(1.0f, -11.3f), 3.14f);
  AddLampPost(mesh, OnGround(-9.6f, -6.2f), 4.0f);
  AddLampPost(mesh, OnGround(4.4f, 6.6f), 4.0f);
  AddLampPost(mesh, OnGround(13.8f, -2.4f), 3.4f);
  for (const float y : {1.7f, 3.1f, 4.5f}) AddBollard(mesh, OnGround(-14.2f, y));
  AddBollard(mesh, OnGround(-2.0f, -10.6f));
  mesh.Box(OnGround(-13.6f, 8.0f), {1.1f, 0.8f, 1.2f}, 0.3f, kDoor);  // a crate
}

}  // namespace

double CourtyardGround(double x, double y) {
  return 0.004 * x - 0.003 * y + 0.03 * std::sin(0.31 * x + 0.4) * std::cos(0.27 * y - 0.2) +
         0.012 * std::sin(0.9 * x - 0.7 * y);
}

TriangleMesh MakeCourtyard(int seed) {
  Rng rng(static_cast<std::uint64_t>(seed));
  MeshBuilder mesh;
  AddGround(mesh, rng);
  AddSouthSide(mesh, rng);
  AddNorthSide(mesh, rng);
  AddEastSide(mesh, rng);
  AddWestSide(mesh, rng);
  AddStreet(mesh, rng);
  AddFurniture(mesh, rng);
  return std::move(mesh).Take();
}

std::vector<Eigen::Vector2d> CourtyardRoute() {
  return {{-11.4, -8.6}, {-7.0, -8.4}, {-2.0, -7.6},  {3.0, -8.4},  {7.5, -8.2}, {11.2, -8.2},
          {11.4, -5.0},  {10.8, -1.5}, {10.9, 2.0},   {10.6, 5.2},  {8.6, 7.2},  {7.4, 9.2},
          {6.0, 10.7},   {2.5, 10.5},  {-2.0, 10.6},  {-5.8, 10.7}, {-7.4, 9.2}, {-9.2, 7.4},
          {-11.4, 5.0},  {-11.8, 1.0}, {-11.2, -3.0}, {-12.2, -6.4}};
}

}  // namespace covsplat
