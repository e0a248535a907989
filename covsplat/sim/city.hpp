// The world "city": a grid of blocks as the street's, for drives as long as a day's work. Along its
// streets from west to east and back, then from south to north and back across them.
#pragma once

#include <vector>

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/mover.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

struct CityPlan {
  int blocks_east = 6;
  int blocks_north = 5;
  int streets_north = 4;  ///< that are driven from end to end, after all that go east
};

WorldMesh MakeCity(int seed, const CityPlan& plan = {});

/// On the right. About 10.6 km with the plan as it is.
Route CityRoute(const CityPlan& plan = {});

/// People on the pavements of every block.
std::vector<Mover> CityPeople(int seed, const CityPlan& plan = {});

}  // namespace covsplat
