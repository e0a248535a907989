// The world "courtyard": 30 x 24 m between four facades, x to the east, y to the north, with the
// origin in the middle. No two sides are alike.
#pragma once

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

WorldMesh MakeCourtyard(int seed);

/// Height in metres of the walkable ground: smooth, without kerbs and steps.
double CourtyardGround(double x, double y);

/// A walk round the courtyard and through the arcade that keeps clear of everything.
Route CourtyardRoute();

}  // namespace covsplat
