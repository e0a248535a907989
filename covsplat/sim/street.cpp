#include "covsplat/sim/street.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/street_block.hpp"
#include "covsplat/sim/street_furniture.hpp"
#include "covsplat/sim/street_plan.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using P = StreetPlan;

const Eigen::Vector2d kOrigin = Eigen::Vector2d::Zero();

void AddGround(MeshBuilder& mesh) {
  constexpr float k = P::kKerb;
  const Vector2f outer_low(-k, -k);
  const Vector2f outer_high(P::kLength + k, P::kWidth + k);
  const Vector2f inner_low(k, k);
  const Vector2f inner_high(P::kLength - k, P::kWidth - k);
  AddRoad(mesh, outer_low, {outer_high.x(), inner_low.y()});
  AddRoad(mesh, {outer_low.x(), inner_high.y()}, outer_high);
  AddRoad(mesh, {outer_low.x(), inner_low.y()}, {inner_low.x(), inner_high.y()});
  AddRoad(mesh, {inner_high.x(), inner_low.y()}, {outer_high.x(), inner_high.y()});
  AddBlockGround(mesh, kOrigin.cast<float>());
  AddOutskirts(mesh, {P::kLength, P::kWidth});
}

// With gaps where side streets leave.
void AddHousesOutside(MeshBuilder& mesh, Rng& rng) {
  constexpr float h = P::kHouses;
  constexpr float kEast = P::kLength;
  constexpr float kNorth = P::kWidth;
  constexpr std::array<std::array<float, 2>, 3> kAlongX = {
      {{-6.0f, 58.0f}, {68.0f, 141.0f}, {151.0f, kEast + 6.0f}}};
  for (const auto& [from, to] : kAlongX) {
    AddHousesAlong(mesh, {from, -h}, {to, -h}, P::kHouseDepth, rng);
    AddHousesAlong(mesh, {kEast - from, kNorth + h}, {kEast - to, kNorth + h}, P::kHouseDepth, rng);
  }
  constexpr std::array<std::array<float, 2>, 2> kAlongY = {
      {{-4.0f, 48.0f}, {57.0f, kNorth + 4.0f}}};
  for (const auto& [from, to] : kAlongY) {
    AddHousesAlong(mesh, {-h, to}, {-h, from}, P::kHouseDepth, rng);
    AddHousesAlong(mesh, {kEast + h, from}, {kEast + h, to}, P::kHouseDepth, rng);
  }
  // What closes the side streets.
  for (const float x : {63.0f, 146.0f}) {
    AddHousesAlong(mesh, {x - 12.0f, -36.0f}, {x + 12.0f, -36.0f}, 8.0f, rng);
    AddHousesAlong(mesh, {x + 12.0f, kNorth + 36.0f}, {x - 12.0f, kNorth + 36.0f}, 8.0f, rng);
  }
  AddHousesAlong(mesh, {-36.0f, 66.0f}, {-36.0f, 40.0f}, 8.0f, rng);
  AddHousesAlong(mesh, {kEast + 36.0f, 40.0f}, {kEast + 36.0f, 66.0f}, 8.0f, rng);
}

}  // namespace

WorldMesh MakeStreet(int seed) {
  Rng rng(static_cast<std::uint64_t>(seed));
  MeshBuilder mesh;
  AddGround(mesh);
  AddBlockHouses(mesh, kOrigin.cast<float>(), rng);
  AddHousesOutside(mesh, rng);
  for (const double side : {1.0, -1.0}) AddStreetFurniture(mesh, kOrigin, side, rng);
  return std::move(mesh).Take();
}

Route StreetRoute() {
  Route route;
  route.controls = StreetRing(kOrigin, static_cast<double>(P::kLane), 12.5);
  // Begin in the middle of the south side.
  std::rotate(route.controls.begin(), route.controls.begin() + 25, route.controls.end());
  route.jitter_m = 0.02;
  route.ground = StreetGround;
  return route;
}

}  // namespace covsplat
