// What stands along streets.
#pragma once

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// Trees, lamps, signs, bins, benches, shelters and parked cars along the streets around the block
/// whose south-west crossing is at `origin`. `side`: 1 outside of the streets' middle, -1 inside.
void AddStreetFurniture(MeshBuilder& mesh, const Eigen::Vector2d& origin, double side, Rng& rng);

}  // namespace covsplat
