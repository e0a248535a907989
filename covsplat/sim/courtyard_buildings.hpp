// The four sides of the world "courtyard" and what can be seen through its passage.
#pragma once

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// South: brick with buttresses. North: an arcade before a plaster wall. East: a high wall with
/// stairs and a tower. West: two parts, the higher with an open passage to a street.
void AddCourtyardBuildings(MeshBuilder& mesh, Rng& rng);

}  // namespace covsplat
