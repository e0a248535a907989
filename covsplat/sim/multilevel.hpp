// The world "multilevel": an office building, 24 by 14 m inside, of three floors that are alike to
// the last plant, joined by straight stairs one above the other.
#pragma once

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

WorldMesh MakeMultilevel(int seed);

/// Round every floor on the way up to the third and down again: closed, about 240 m.
Route MultilevelRoute();

}  // namespace covsplat
