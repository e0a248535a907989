// The world "street": a ring of streets, 200 by 115 m between its centre lines, round city blocks.
// The sensor drives counter-clockwise on the right, so on the outer lane.
#pragma once

#include <vector>

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/mover.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

WorldMesh MakeStreet(int seed);

/// Once round, about 620 m.
Route StreetRoute();

/// Cars that come the other way on the inner lane, and people on the pavements.
std::vector<Mover> StreetTraffic(int seed);

}  // namespace covsplat
