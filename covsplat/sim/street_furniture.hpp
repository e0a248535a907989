// What stands along the streets of the world "street".
#pragma once

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// Trees, lamps, signs, bins, benches, shelters and parked cars on both sides.
void AddStreetFurniture(MeshBuilder& mesh, Rng& rng);

}  // namespace covsplat
