#include "covsplat/sim/street_block.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/sim/buildings.hpp"
#include "covsplat/sim/street_plan.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using P = StreetPlan;

constexpr float kAsphalt = 0.2f;
constexpr float kPaving = 0.45f;
constexpr float kStone = 0.55f;

float Ground(float x, float y) { return static_cast<float>(StreetGround(x, y)); }
float Pavement(float x, float y) { return Ground(x, y) + P::kKerbHeight; }

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

}  // namespace

void AddRoad(MeshBuilder& mesh, const Vector2f& low, const Vector2f& high) {
  const auto shade = [](float x, float y) {  // patches of repair
    return kAsphalt + 0.04f * std::sin(0.9f * x) * std::sin(1.3f * y + 0.4f * x);
  };
  mesh.HeightField(low, high, 1.5f, Ground, shade);
}

void AddBlockGround(MeshBuilder& mesh, const Vector2f& origin) {
  constexpr float k = P::kKerb;
  const Vector2f low = origin + Vector2f(k, k);
  const Vector2f high = origin + Vector2f(P::kLength - k, P::kWidth - k);
  AddPavement(mesh, low, high);
  AddKerbRing(mesh, low, high);
}

void AddBlockHouses(MeshBuilder& mesh, const Vector2f& origin, Rng& rng) {
  constexpr float h = P::kHouses;
  constexpr float kEast = P::kLength;
  constexpr float kNorth = P::kWidth;
  const auto row = [&](const Vector2f& from, const Vector2f& to) {
    AddHousesAlong(mesh, origin + from, origin + to, P::kHouseDepth, rng);
  };
  row({kEast - h, h}, {h, h});
  row({h, kNorth - h}, {kEast - h, kNorth - h});
  row({h, h + 10.0f}, {h, kNorth - h - 10.0f});
  row({kEast - h, kNorth - h - 10.0f}, {kEast - h, h + 10.0f});
}

void AddOutskirts(MeshBuilder& mesh, const Vector2f& size) {
  constexpr float k = P::kKerb;
  constexpr float far = P::kBeyond;
  AddPavement(mesh, {-far, -far}, {size.x() + far, -k});
  AddPavement(mesh, {-far, size.y() + k}, {size.x() + far, size.y() + far});
  AddPavement(mesh, {-far, -k}, {-k, size.y() + k});
  AddPavement(mesh, {size.x() + k, -k}, {size.x() + far, size.y() + k});
  AddKerbRing(mesh, {-k, -k}, size + Vector2f(k, k));
}

void AddHousesAlong(
    MeshBuilder& mesh, const Vector2f& from, const Vector2f& to, float depth, Rng& rng) {
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

}  // namespace covsplat
