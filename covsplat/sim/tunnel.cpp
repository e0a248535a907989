#include "covsplat/sim/tunnel.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/props.hpp"
#include "covsplat/sim/street_props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kWest = 0.0f;  // x of the portals
constexpr float kEast = 220.0f;
constexpr float kOutside = 45.0f;  // the ground goes on so far
constexpr float kRadius = 4.8f;    // half the width, and the vault's radius
constexpr float kSpring = 1.9f;    // height at which the vault begins
constexpr float kConcrete = 0.45f;
constexpr float kAsphalt = 0.2f;
constexpr float kStone = 0.55f;
constexpr float kQuarter = 0.5f * std::numbers::pi_v<float>;

// A straight strip from portal to portal between two lines of the cross section.
void AddStrip(MeshBuilder& mesh, const Eigen::Vector2f& a, const Eigen::Vector2f& b, float shade) {
  constexpr float kBay = 20.0f;
  for (float x = kWest; x < kEast; x += kBay) {
    mesh.Quad({x, a.x(), a.y()},
              {x + kBay, a.x(), a.y()},
              {x + kBay, b.x(), b.y()},
              {x, b.x(), b.y()},
              shade);
  }
}

void AddTube(MeshBuilder& mesh) {
  constexpr int kSegments = 16;
  for (int k = 0; k < kSegments; ++k) {
    const auto point = [&](int i) {
      const float angle = std::numbers::pi_v<float> * static_cast<float>(i) / kSegments;
      return Eigen::Vector2f(-kRadius * std::cos(angle), kSpring + kRadius * std::sin(angle));
    };
    AddStrip(mesh, point(k), point(k + 1), kConcrete);
  }
  constexpr float kWalk = 0.9f;
  constexpr float kKerb = 0.25f;
  for (const float side : {-1.0f, 1.0f}) {
    const float wall = side * kRadius;
    const float kerb = side * (kRadius - kWalk);
    AddStrip(mesh, {wall, -0.1f}, {wall, kSpring}, kConcrete);
    AddStrip(mesh, {wall, kKerb}, {kerb, kKerb}, kStone);
    AddStrip(mesh, {kerb, kKerb}, {kerb, -0.1f}, kStone);
    const float tray = wall - side * 0.3f;  // for cables
    AddStrip(mesh, {tray, 2.3f}, {tray, 2.42f}, 0.3f);
    AddStrip(mesh, {tray, 2.3f}, {wall, 2.3f}, 0.3f);
  }
  AddStrip(mesh, {-0.2f, 6.3f}, {0.2f, 6.3f}, 0.8f);  // the lights
}

// The masonry round a tunnel's mouth, wing walls, and what stands before it.
void AddPortal(MeshBuilder& mesh, float x, float outward, Rng& rng) {
  const Panel face{
      {x, -outward * 14.0f, 0.0f}, outward * Vector3f::UnitY(), outward * Vector3f::UnitX()};
  const float low = 14.0f - kRadius;
  const float high = 14.0f + kRadius;
  constexpr float kTop = 9.0f;
  for (const float u : {0.0f, high}) {
    mesh.Quad(face.At(u, -0.5f),
              face.At(u + low, -0.5f),
              face.At(u + low, kTop),
              face.At(u, kTop),
              kStone);
  }
  mesh.Arch(face, low, high, kSpring, kTop, 0.0f, kStone);
  mesh.Box(face.At(14.0f, kTop, -0.2f), {29.0f, 0.6f, 0.5f}, kQuarter, kStone);
  for (const float u : {low - 0.9f, high + 0.9f}) {
    mesh.Box(face.At(u, -0.5f, -0.4f), {1.0f, 0.8f, 7.0f}, kQuarter, kStone);
  }
  for (const float side : {-1.0f, 1.0f}) {
    for (int i = 0; i < 4; ++i) {  // wing walls that step down
      const float along = 2.5f + 4.0f * static_cast<float>(i);
      mesh.Box({x + outward * along, side * (8.5f + 0.5f * static_cast<float>(i)), -0.5f},
               {4.0f, 0.6f, 6.5f - 1.3f * static_cast<float>(i)},
               0.0f,
               kStone);
    }
    AddTree(mesh, {x + outward * 21.0f, side * 10.5f, 0.0f}, 6.5f, 2.0f, rng);
    AddTree(mesh, {x + outward * 33.0f, side * 12.5f, 0.0f}, 5.5f, 1.8f, rng);
    AddHedge(mesh, {x + outward * 27.0f, side * 8.0f, 0.0f}, {5.0f, 0.8f, 1.1f}, 0.0f, rng);
    AddLampPost(mesh, {x + outward * 12.0f, side * 6.6f, 0.0f}, 6.0f);
    AddRoadSign(
        mesh, {x + outward * 8.0f, side * 6.2f, 0.0f}, outward > 0.0f ? 0.0f : 2.0f * kQuarter);
    AddBollard(mesh, {x + outward * 17.0f, side * 6.0f, 0.0f});
  }
  mesh.Box({x + outward * 30.0f, 17.0f, -0.3f}, {7.0f, 5.0f, 4.0f}, 0.1f, kConcrete);  // plant room
  // Cabinets just inside.
  for (const float inside : {6.0f, 13.0f}) {
    mesh.Box({x - outward * inside, kRadius - 0.2f, 0.25f}, {0.8f, 0.4f, 1.6f}, 0.0f, 0.3f);
  }
}

void AddGround(MeshBuilder& mesh) {
  const auto rough = [](float x, float y) {  // flat on the road
    const float beside = std::max(0.0f, std::abs(y) - 5.5f);
    return std::min(beside, 4.0f) * (0.05f + 0.05f * std::sin(0.7f * x) * std::cos(0.9f * y));
  };
  const auto shade = [](float, float y) { return std::abs(y) < 5.5f ? kAsphalt : 0.35f; };
  mesh.HeightField({kWest - kOutside, -25.0f}, {kWest, 25.0f}, 0.8f, rough, shade);
  mesh.HeightField({kEast, -25.0f}, {kEast + kOutside, 25.0f}, 0.8f, rough, shade);
  AddStrip(mesh, {-kRadius, 0.0f}, {kRadius, 0.0f}, kAsphalt);
}

}  // namespace

WorldMesh MakeTunnel(int seed) {
  Rng rng(static_cast<std::uint64_t>(seed));
  MeshBuilder mesh;
  AddGround(mesh);
  AddTube(mesh);
  AddPortal(mesh, kWest, -1.0f, rng);
  AddPortal(mesh, kEast, 1.0f, rng);
  return std::move(mesh).Take();
}

Route TunnelRoute() {
  constexpr double kLane = -1.8;  // y
  constexpr double kMargin = 20.0;
  Route route;
  route.closed = false;
  route.controls = AlongLines({{static_cast<double>(kWest) - kMargin, kLane, 0.0},
                               {static_cast<double>(kEast) + kMargin, kLane, 0.0}},
                              false,
                              8.0);
  route.jitter_m = 0.05;
  return route;
}

}  // namespace covsplat
