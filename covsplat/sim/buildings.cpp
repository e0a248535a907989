#include "covsplat/sim/buildings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kTiles = 0.3f;
constexpr float kDoor = 0.25f;
constexpr float kStone = 0.6f;

float Draw(Rng& rng, float low, float high) { return static_cast<float>(rng.Uniform(low, high)); }

float YawOf(const Panel& panel) { return std::atan2(panel.along.y(), panel.along.x()); }

// Flanks, rear and both sides of the roof, whose ridge is half way back.
void AddHouseBody(MeshBuilder& mesh,
                  const Panel& panel,
                  const WallSize& size,
                  float depth,
                  float rise,
                  float reflectivity) {
  const float top = size.z_high;
  for (const float u : {0.0f, size.width}) {
    mesh.Quad(panel.At(u, size.z_low),
              panel.At(u, size.z_low, depth),
              panel.At(u, top, depth),
              panel.At(u, top),
              reflectivity);
    mesh.Facet(panel.At(u, top),
               panel.At(u, top, depth),
               panel.At(u, top + rise, 0.5f * depth),
               reflectivity);
  }
  mesh.Quad(panel.At(0.0f, size.z_low, depth),
            panel.At(size.width, size.z_low, depth),
            panel.At(size.width, top, depth),
            panel.At(0.0f, top, depth),
            reflectivity);
  AddRoof(mesh, panel, size.width, top, 0.5f * depth, rise);
  AddRoof(mesh, RearOf(panel, size.width, depth), size.width, top, 0.5f * depth, rise);
}

// A garden's hedge and its gate posts in front of a house that is set back.
void AddFrontGarden(MeshBuilder& mesh, const Panel& panel, float width, Rng& rng) {
  const float yaw = YawOf(panel);
  const float half = 0.5f * (width - 1.6f);
  for (const float u : {0.5f * half, width - 0.5f * half}) {
    AddHedge(mesh, panel.At(u, 0.0f, 0.3f), {half, 0.6f, Draw(rng, 0.8f, 1.4f)}, yaw, rng);
  }
  for (const float u : {half + 0.1f, width - half - 0.1f}) {
    mesh.Box(panel.At(u, -0.2f, 0.3f), {0.3f, 0.3f, 1.5f}, yaw, kStone);
  }
}

}  // namespace

Opening Door(float u, float width, float z, float height) {
  return {u, u + width, z, z + height, 0.45f, false, kDoor};
}

void AddFacade(MeshBuilder& mesh,
               const Panel& panel,
               const WallSize& size,
               const std::vector<Opening>& doors,
               const WindowGrid& grid,
               float reflectivity,
               Rng& rng) {
  const std::vector<Opening> windows = MakeWindows(grid, doors, rng);
  std::vector<Opening> openings = doors;
  openings.insert(openings.end(), windows.begin(), windows.end());
  mesh.Wall(panel, size.width, size.z_low, size.z_high, openings, reflectivity);
  AddWindowFrames(mesh, panel, windows);
}

void AddRoof(
    MeshBuilder& mesh, const Panel& panel, float width, float eaves, float run, float rise) {
  const float drop = 0.5f * rise / run;
  mesh.Quad(panel.At(0.0f, eaves - drop, -0.5f),
            panel.At(width, eaves - drop, -0.5f),
            panel.At(width, eaves + rise, run),
            panel.At(0.0f, eaves + rise, run),
            kTiles);
}

Panel RearOf(const Panel& panel, float width, float depth) {
  return {panel.At(width, 0.0f, depth), -panel.along, -panel.outward};
}

void AddRearFace(MeshBuilder& mesh,
                 const Panel& panel,
                 const WallSize& size,
                 float thickness,
                 const std::vector<Opening>& passages,
                 float reflectivity) {
  std::vector<Opening> holes;
  for (const Opening& passage : passages) {
    Opening hole = passage;
    hole.u_low = size.width - passage.u_high;
    hole.u_high = size.width - passage.u_low;
    hole.depth = 0.0f;
    holes.push_back(hole);
  }
  const Panel rear = RearOf(panel, size.width, thickness);
  mesh.Wall(rear, size.width, size.z_low, size.z_high, holes, reflectivity);
}

void AddHouse(MeshBuilder& mesh, const Panel& panel, float width, float depth, Rng& rng) {
  const int floors = 2 + static_cast<int>(rng.Below(3));
  const float storey = Draw(rng, 2.9f, 3.4f);
  const WallSize size{width, -1.5f, storey * static_cast<float>(floors) + 0.4f};
  const float shade = Draw(rng, 0.35f, 0.75f);
  const float yaw = YawOf(panel);

  WindowGrid grid;
  grid.width_m = Draw(rng, 1.0f, 1.6f);
  grid.height_m = Draw(rng, 1.3f, 1.9f);
  grid.pitch_m = grid.width_m + Draw(rng, 1.0f, 1.8f);
  grid.count = std::max(1, static_cast<int>((width - 1.0f) / grid.pitch_m));
  grid.first_u =
      0.5f * (width - grid.pitch_m * static_cast<float>(grid.count) + grid.pitch_m - grid.width_m);
  for (int k = 0; k < floors; ++k) grid.sills_m.push_back(0.9f + storey * static_cast<float>(k));

  const float door_u = Draw(rng, 0.6f, width - 2.0f);
  AddFacade(mesh, panel, size, {Door(door_u, 1.2f, -0.1f, 2.4f)}, grid, shade, rng);
  AddHouseBody(mesh, panel, size, depth, Draw(rng, 1.8f, 3.6f), shade);
  mesh.Box(panel.At(door_u + 0.6f, -0.4f, -0.2f), {1.6f, 0.4f, 0.45f}, yaw, kStone);
  mesh.Box(panel.At(0.5f * width, size.z_high - 0.3f, -0.1f), {width, 0.3f, 0.3f}, yaw, kStone);
  if (rng.Uniform() < 0.5) {  // a string course, or a bay window
    mesh.Box(panel.At(0.5f * width, storey - 0.1f, 0.0f), {width, 0.16f, 0.18f}, yaw, kStone);
  } else {
    const float bay_u = door_u < 0.5f * width ? 0.75f * width : 0.25f * width;
    mesh.Box(panel.At(bay_u, -0.5f, -0.3f), {1.9f, 0.7f, storey + 0.2f}, yaw, shade);
  }
  mesh.Box(panel.At(Draw(rng, 1.0f, width - 1.0f), size.z_high, 0.5f * depth),
           {0.9f, 0.7f, 5.0f},
           yaw,
           shade);  // chimney
}

void AddHouseRow(MeshBuilder& mesh, const Panel& panel, float length, float depth, Rng& rng) {
  float u = 0.0f;
  while (length - u > 6.0f) {
    float width = Draw(rng, 8.0f, 15.0f);
    if (length - u - width < 6.0f) width = length - u;
    const bool garden = rng.Uniform() < 0.3;
    const float setback = garden ? 2.5f : Draw(rng, 0.0f, 0.6f);
    if (garden) AddFrontGarden(mesh, {panel.At(u, 0.0f), panel.along, panel.outward}, width, rng);
    AddHouse(mesh,
             {panel.At(u, 0.0f, setback), panel.along, panel.outward},
             width,
             depth - setback,
             rng);
    u += width;
    if (rng.Uniform() < 0.2) u += Draw(rng, 1.5f, 3.0f);  // an alley
  }
}

void AddStairs(MeshBuilder& mesh, const Panel& panel, const Stairs& stairs, float reflectivity) {
  const float yaw = YawOf(panel);
  for (int i = 0; i < stairs.steps; ++i) {
    const float u = stairs.run * (static_cast<float>(i) + 0.5f);
    const float top = stairs.rise * static_cast<float>(i + 1);
    const float bottom = stairs.thickness > 0.0f ? top - stairs.thickness : -0.2f;
    mesh.Box(panel.At(u, bottom, -0.5f * stairs.width),
             {stairs.run, stairs.width, top - bottom},
             yaw,
             reflectivity);
    mesh.Box(panel.At(u, bottom, -stairs.width - 0.06f),
             {stairs.run, 0.12f, top + 0.35f - bottom},
             yaw,
             reflectivity);
  }
}

void AddRailing(
    MeshBuilder& mesh, const Vector3f& from, const Vector3f& to, float height, float reflectivity) {
  constexpr float kPitch = 0.35f;
  const Vector3f line = to - from;
  const float yaw = std::atan2(line.y(), line.x());
  const int posts = std::max(1, static_cast<int>(line.norm() / kPitch));
  for (int i = 0; i <= posts; ++i) {
    const Vector3f foot = from + line * (static_cast<float>(i) / static_cast<float>(posts));
    mesh.Cylinder(foot, 0.03f, 0.03f, height, 6, reflectivity);
  }
  const Vector3f middle = 0.5f * (from + to);
  mesh.Box(middle + Vector3f(0.0f, 0.0f, height - 0.06f),
           {line.norm() + 0.1f, 0.1f, 0.08f},
           yaw,
           reflectivity);
}

}  // namespace covsplat
