#include "covsplat/sim/street.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/buildings.hpp"
#include "covsplat/sim/street_furniture.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using P = StreetPlan;

constexpr float kAsphalt = 0.2f;
constexpr float kPaving = 0.45f;
constexpr float kStone = 0.55f;

float Ground(float x, float y) { return static_cast<float>(StreetGround(x, y)); }
float Pavement(float x, float y) { return Ground(x, y) + P::kKerbHeight; }

void AddRoad(MeshBuilder& mesh, const Vector2f& low, const Vector2f& high) {
  const auto shade = [](float x, float y) {  // patches of repair
    return kAsphalt + 0.04f * std::sin(0.9f * x) * std::sin(1.3f * y + 0.4f * x);
  };
  mesh.HeightField(low, high, 1.5f, Ground, shade);
}

void AddPavement(MeshBuilder& mesh, const Vector2f& low, const Vector2f& high) {
  if ((high - low).minCoeff() <= 0.0f) return;
  mesh.HeightField(low, high, 2.0f, Pavement, [](float, float) { return kPaving; });
}

// Kerb stones along a line, following the ground.
void AddKerb(MeshBuilder& mesh, const Vector2f& from, const Vector2f& to) {
  const Vector2f line = to - from;
  const int stones = std::max(1, static_cast<int>(line.norm() / 2.0f));
  const float yaw = std::atan2(line.y(), line.x());
  for (int i = 0; i < stones; ++i) {
    const Vector2f at = from + line * ((static_cast<float>(i) + 0.5f) / static_cast<float>(stones));
    mesh.Box({at.x(), at.y(), Ground(at.x(), at.y()) - 0.1f},
             {line.norm() / static_cast<float>(stones) - 0.01f, 0.16f, 0.11f + P::kKerbHeight},
             yaw,
             kStone);
  }
}

void AddKerbRing(MeshBuilder& mesh, const Vector2f& low, const Vector2f& high) {
  AddKerb(mesh, low, {high.x(), low.y()});
  AddKerb(mesh, {high.x(), low.y()}, high);
  AddKerb(mesh, high, {low.x(), high.y()});
  AddKerb(mesh, {low.x(), high.y()}, low);
}

void AddGround(MeshBuilder& mesh) {
  constexpr float k = P::kKerb;
  constexpr float far = P::kBeyond;
  const Vector2f outer_low(-k, -k);
  const Vector2f outer_high(P::kLength + k, P::kWidth + k);
  const Vector2f inner_low(k, k);
  const Vector2f inner_high(P::kLength - k, P::kWidth - k);
  AddRoad(mesh, outer_low, {outer_high.x(), inner_low.y()});
  AddRoad(mesh, {outer_low.x(), inner_high.y()}, outer_high);
  AddRoad(mesh, {outer_low.x(), inner_low.y()}, {inner_low.x(), inner_high.y()});
  AddRoad(mesh, {inner_high.x(), inner_low.y()}, {outer_high.x(), inner_high.y()});
  AddPavement(mesh, inner_low, inner_high);
  AddPavement(mesh, {-far, -far}, {P::kLength + far, -k});
  AddPavement(mesh, {-far, P::kWidth + k}, {P::kLength + far, P::kWidth + far});
  AddPavement(mesh, {-far, -k}, {-k, P::kWidth + k});
  AddPavement(mesh, {P::kLength + k, -k}, {P::kLength + far, P::kWidth + k});
  AddKerbRing(mesh, outer_low, outer_high);
  AddKerbRing(mesh, inner_low, inner_high);
}

// A row of houses from one point to another, facing left of that direction; every stretch of it
// stands on the ground there.
void AddRow(MeshBuilder& mesh, const Vector2f& from, const Vector2f& to, float depth, Rng& rng) {
  constexpr float kStretch = 32.0f;
  const float length = (to - from).norm();
  const Vector2f line = (to - from) / length;
  const auto stretches = static_cast<int>(std::ceil(length / kStretch));
  const float stretch = length / static_cast<float>(stretches);
  for (int i = 0; i < stretches; ++i) {
    const Vector2f corner = from + line * stretch * static_cast<float>(i);
    const Vector2f middle = corner + 0.5f * stretch * line;
    const Panel panel{{corner.x(), corner.y(), Pavement(middle.x(), middle.y())},
                      {line.x(), line.y(), 0.0f},
                      {-line.y(), line.x(), 0.0f}};
    AddHouseRow(mesh, panel, stretch, depth, rng);
  }
}

// Round the inner block, and outside with gaps where side streets leave.
void AddHouses(MeshBuilder& mesh, Rng& rng) {
  constexpr float h = P::kHouses;
  constexpr float kDepth = 9.0f;
  constexpr float kEast = P::kLength;
  constexpr float kNorth = P::kWidth;
  AddRow(mesh, {kEast - h, h}, {h, h}, kDepth, rng);
  AddRow(mesh, {h, kNorth - h}, {kEast - h, kNorth - h}, kDepth, rng);
  AddRow(mesh, {h, h + 10.0f}, {h, kNorth - h - 10.0f}, kDepth, rng);
  AddRow(mesh, {kEast - h, kNorth - h - 10.0f}, {kEast - h, h + 10.0f}, kDepth, rng);

  constexpr std::array<std::array<float, 2>, 3> kAlongX = {
      {{-6.0f, 58.0f}, {68.0f, 141.0f}, {151.0f, kEast + 6.0f}}};
  for (const auto& [from, to] : kAlongX) {
    AddRow(mesh, {from, -h}, {to, -h}, kDepth, rng);
    AddRow(mesh, {kEast - from, kNorth + h}, {kEast - to, kNorth + h}, kDepth, rng);
  }
  constexpr std::array<std::array<float, 2>, 2> kAlongY = {
      {{-4.0f, 48.0f}, {57.0f, kNorth + 4.0f}}};
  for (const auto& [from, to] : kAlongY) {
    AddRow(mesh, {-h, to}, {-h, from}, kDepth, rng);
    AddRow(mesh, {kEast + h, from}, {kEast + h, to}, kDepth, rng);
  }
  // What closes the side streets.
  for (const float x : {63.0f, 146.0f}) {
    AddRow(mesh, {x - 12.0f, -36.0f}, {x + 12.0f, -36.0f}, 8.0f, rng);
    AddRow(mesh, {x + 12.0f, kNorth + 36.0f}, {x - 12.0f, kNorth + 36.0f}, 8.0f, rng);
  }
  AddRow(mesh, {-36.0f, 66.0f}, {-36.0f, 40.0f}, 8.0f, rng);
  AddRow(mesh, {kEast + 36.0f, 40.0f}, {kEast + 36.0f, 66.0f}, 8.0f, rng);
}

}  // namespace

double StreetGround(double x, double y) {
  return 0.5 * std::sin(0.021 * x + 0.4) * std::cos(0.03 * y) + 0.004 * y;
}

std::vector<Eigen::Vector3d> StreetRing(double offset_m, double corner_radius_m) {
  constexpr double kSpacingM = 3.0;
  const Eigen::Vector2d low(-offset_m, -offset_m);
  const Eigen::Vector2d high(static_cast<double>(P::kLength) + offset_m,
                             static_cast<double>(P::kWidth) + offset_m);
  const std::array<Eigen::Vector2d, 4> corners = {
      low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  // Each side's straight part, then the arc to the next side; spline controls lie on them.
  std::vector<Eigen::Vector3d> ring;
  for (std::size_t side = 0; side < 4; ++side) {
    const double heading = static_cast<double>(side) * 0.5 * std::numbers::pi;
    const Eigen::Vector2d along(std::round(std::cos(heading)), std::round(std::sin(heading)));
    const Eigen::Vector2d left(-along.y(), along.x());
    const Eigen::Vector2d from = corners[side] + corner_radius_m * along;
    const Eigen::Vector2d to = corners[(side + 1) % 4] - corner_radius_m * along;
    const int steps = static_cast<int>(std::ceil((to - from).norm() / kSpacingM));
    for (int k = 0; k < steps; ++k) {
      const Eigen::Vector2d point = from + (to - from) * k / steps;
      ring.emplace_back(point.x(), point.y(), 0.0);
    }
    const double quarter_m = 0.5 * std::numbers::pi * corner_radius_m;
    const int arc_steps = std::max(1, static_cast<int>(std::ceil(quarter_m / kSpacingM)));
    for (int k = 0; k < arc_steps; ++k) {
      const double turn = 0.5 * std::numbers::pi * k / arc_steps;
      const Eigen::Vector2d point =
          to + corner_radius_m * (std::sin(turn) * along + (1.0 - std::cos(turn)) * left);
      ring.emplace_back(point.x(), point.y(), 0.0);
    }
  }
  return ring;
}

WorldMesh MakeStreet(int seed) {
  Rng rng(static_cast<std::uint64_t>(seed));
  MeshBuilder mesh;
  AddGround(mesh);
  AddHouses(mesh, rng);
  AddStreetFurniture(mesh, rng);
  return std::move(mesh).Take();
}

Route StreetRoute() {
  Route route;
  route.controls = StreetRing(static_cast<double>(P::kLane), 12.5);
  // Begin in the middle of the south side.
  std::rotate(route.controls.begin(), route.controls.begin() + 25, route.controls.end());
  route.jitter_m = 0.02;
  route.ground = StreetGround;
  return route;
}

}  // namespace covsplat
