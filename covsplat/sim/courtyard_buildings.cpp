#include "covsplat/sim/courtyard_buildings.hpp"

#include <numbers>
#include <vector>

#include "covsplat/sim/buildings.hpp"
#include "covsplat/sim/courtyard.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kStone = 0.6f;
constexpr float kPlaster = 0.7f;
constexpr float kBrick = 0.4f;
constexpr float kTiles = 0.3f;
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

void AddSouthSide(MeshBuilder& mesh, Rng& rng) {
  const Panel panel = SouthWall();
  AddFacade(mesh,
            panel,
            {30.0f, kFoundation, 9.0f},
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

// From the ground up to `top`, on which two arches rest.
void AddColumn(MeshBuilder& mesh, const Vector3f& top) {
  const Vector3f base = OnGround(top.x(), top.y());
  mesh.Box(base - Vector3f(0.0f, 0.0f, 0.2f), {0.66f, 0.66f, 0.5f}, 0.0f, kStone);
  mesh.Cylinder(base, 0.24f, 0.20f, top.z() - 0.2f - base.z(), 20, kStone);
  mesh.Box(top - Vector3f(0.0f, 0.0f, 0.25f), {0.62f, 0.62f, 0.25f}, 0.0f, kStone);
}

void AddArcade(MeshBuilder& mesh) {
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
    if (bay > 0) AddColumn(mesh, front.At(u, kSpring, 0.25f));
  }
  // Lean-to roof over the arcade.
  mesh.Quad(front.At(0.0f, 3.95f, -0.4f),
            front.At(30.0f, 3.95f, -0.4f),
            front.At(30.0f, 5.2f, 3.0f),
            front.At(0.0f, 5.2f, 3.0f),
            kTiles);
}

void AddNorthSide(MeshBuilder& mesh, Rng& rng) {
  AddFacade(mesh,
            NorthWall(),
            {30.0f, kFoundation, 11.0f},
            {Door(4.0f, 1.2f, -0.2f, 2.4f),
             Door(14.2f, 1.8f, -0.2f, 2.8f),
             Door(24.5f, 1.2f, -0.2f, 2.4f)},
            {1.0f, 3.3f, 9, 1.3f, 1.9f, {1.0f, 5.6f, 8.4f}},
            kPlaster,
            rng);
  AddArcade(mesh);
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
            {24.0f, kFoundation, 12.0f},
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
            {kLowWidth, kFoundation, 8.0f},
            {Door(2.6f, 1.3f, -0.2f, 2.5f)},
            {1.0f, 2.6f, 5, 1.1f, 1.5f, {1.2f, 5.2f}},
            kStone,
            rng);
  AddRoof(mesh, low, kLowWidth, 8.0f, 4.5f, 4.0f);
  mesh.Box(low.At(7.9f, 3.1f, -0.45f), {0.9f, 2.2f, 3.4f}, 0.0f, kPlaster);  // an oriel
  const Panel high{low.At(kLowWidth, 0.0f), low.along, low.outward};
  AddFacade(mesh,
            high,
            {11.0f, kFoundation, 10.7f},
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
            {40.0f, kFoundation, 11.0f},
            {Door(22.0f, 1.6f, -0.3f, 2.8f)},
            {1.5f, 2.8f, 13, 1.3f, 1.7f, {1.0f, 4.2f, 7.4f}},
            kBrick,
            rng);
  AddParkedCar(mesh, OnGround(-35.5f, 1.0f), 1.55f);
  AddParkedCar(mesh, OnGround(-35.4f, 7.2f), 1.6f);
  AddTree(mesh, OnGround(-28.5f, 4.6f), 6.0f, 1.7f, rng);
  AddLampPost(mesh, OnGround(-25.5f, 1.5f), 4.5f);
}

}  // namespace

void AddCourtyardBuildings(MeshBuilder& mesh, Rng& rng) {
  AddSouthSide(mesh, rng);
  AddNorthSide(mesh, rng);
  AddEastSide(mesh, rng);
  AddWestSide(mesh, rng);
  AddStreet(mesh, rng);
}

}  // namespace covsplat
