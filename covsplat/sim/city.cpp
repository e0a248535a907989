#include "covsplat/sim/city.hpp"

#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/street_block.hpp"
#include "covsplat/sim/street_furniture.hpp"
#include "covsplat/sim/street_people.hpp"
#include "covsplat/sim/street_plan.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2f;
using P = StreetPlan;

// Where the streets numbered so from the west and from the south cross.
Vector2d Crossing(int east, int north) {
  return {east * static_cast<double>(P::kLength), north * static_cast<double>(P::kWidth)};
}

void AddRoads(MeshBuilder& mesh, const CityPlan& plan) {
  constexpr float k = P::kKerb;
  const auto at = [](int east, int north) -> Vector2f {
    return Crossing(east, north).cast<float>();
  };
  for (int north = 0; north <= plan.blocks_north; ++north) {
    AddRoad(mesh, at(0, north) - Vector2f(k, k), at(plan.blocks_east, north) + Vector2f(k, k));
    if (north == plan.blocks_north) break;
    for (int east = 0; east <= plan.blocks_east; ++east) {
      AddRoad(mesh, at(east, north) + Vector2f(-k, k), at(east, north + 1) + Vector2f(k, -k));
    }
  }
}

void AddHousesOutside(MeshBuilder& mesh, const Vector2f& size, Rng& rng) {
  constexpr float h = P::kHouses;
  const auto row = [&](const Vector2f& from, const Vector2f& to) {
    AddHousesAlong(mesh, from, to, P::kHouseDepth, rng);
  };
  row({-6.0f, -h}, {size.x() + 6.0f, -h});
  row({size.x() + 6.0f, size.y() + h}, {-6.0f, size.y() + h});
  row({-h, size.y() + 4.0f}, {-h, -4.0f});
  row({size.x() + h, -4.0f}, {size.x() + h, size.y() + 4.0f});
}

template <class Function>
void ForEachBlock(const CityPlan& plan, const Function& function) {
  for (int north = 0; north < plan.blocks_north; ++north) {
    for (int east = 0; east < plan.blocks_east; ++east) function(Crossing(east, north));
  }
}

// Crossings where the way turns: to and fro along every street that goes east, then along some that
// go north.
std::vector<Vector2d> Turns(const CityPlan& plan) {
  std::vector<Vector2d> turns;
  int east = 0;
  int north = 0;
  for (; north <= plan.blocks_north; ++north) {
    turns.push_back(Crossing(east, north));
    east = plan.blocks_east - east;
    turns.push_back(Crossing(east, north));
  }
  // From the end of the last one back over the others.
  north = plan.blocks_north;
  const int step = east == 0 ? 1 : -1;
  for (int street = 0; street < plan.streets_north; ++street, east += step) {
    if (street > 0) turns.push_back(Crossing(east, north));
    north = plan.blocks_north - north;
    turns.push_back(Crossing(east, north));
  }
  return turns;
}

// The same way in the right lane.
std::vector<Vector2d> InLane(const std::vector<Vector2d>& turns) {
  const auto aside = [&](std::size_t leg) -> Vector2d {
    const Vector2d along = (turns[leg + 1] - turns[leg]).normalized();
    return static_cast<double>(P::kLane) * Vector2d(along.y(), -along.x());
  };
  std::vector<Vector2d> lane;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const bool comes = i > 0;
    const bool leaves = i + 1 < turns.size();
    Vector2d at = turns[i];
    if (comes) at += aside(i - 1);
    if (leaves) at += aside(i);
    lane.push_back(at);
  }
  return lane;
}

}  // namespace

WorldMesh MakeCity(int seed, const CityPlan& plan) {
  Rng rng(static_cast<std::uint64_t>(seed));
  const Vector2f size = Crossing(plan.blocks_east, plan.blocks_north).cast<float>();
  MeshBuilder mesh;
  AddRoads(mesh, plan);
  AddOutskirts(mesh, size);
  AddHousesOutside(mesh, size, rng);
  ForEachBlock(plan, [&](const Vector2d& origin) {
    AddBlockGround(mesh, origin.cast<float>());
    AddBlockHouses(mesh, origin.cast<float>(), rng);
    AddStreetFurniture(mesh, origin, -1.0, rng);
  });
  return std::move(mesh).Take();
}

Route CityRoute(const CityPlan& plan) {
  constexpr double kCornerM = 7.0;
  constexpr double kSpacingM = 4.0;
  Route route;
  route.closed = false;
  route.controls = AlongStreets(InLane(Turns(plan)), route.closed, kCornerM, kSpacingM);
  route.jitter_m = 0.02;
  route.ground = StreetGround;
  return route;
}

std::vector<Mover> CityPeople(int seed, const CityPlan& plan) {
  Rng rng(static_cast<std::uint64_t>(seed), 2);
  std::vector<Mover> people;
  ForEachBlock(plan, [&](const Vector2d& origin) {
    for (const double from_m : {40.0, 230.0, 420.0}) {
      people.push_back(Stroller(origin, -8.3, from_m + rng.Uniform(0.0, 40.0), rng));
    }
  });
  return people;
}

}  // namespace covsplat
