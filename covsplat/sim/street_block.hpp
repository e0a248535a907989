// What streets and the blocks between them are made of, for the worlds "street" and "city". All
// follow the ground (StreetGround); lengths in metres.
#pragma once

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

void AddRoad(MeshBuilder& mesh, const Eigen::Vector2f& low, const Eigen::Vector2f& high);

/// Pavement and kerb of a block whose south-west crossing is at `origin`.
void AddBlockGround(MeshBuilder& mesh, const Eigen::Vector2f& origin);

/// Houses along its four sides, facing the streets.
void AddBlockHouses(MeshBuilder& mesh, const Eigen::Vector2f& origin, Rng& rng);

/// Pavement and kerb outside of streets whose outermost centre lines are `size` apart, from the
/// world's origin on.
void AddOutskirts(MeshBuilder& mesh, const Eigen::Vector2f& size);

/// A row of houses from one point to another, facing left of that direction; every stretch of it
/// stands on the ground there.
void AddHousesAlong(MeshBuilder& mesh,
                    const Eigen::Vector2f& from,
                    const Eigen::Vector2f& to,
                    float depth,
                    Rng& rng);

}  // namespace covsplat
