// The world "tunnel": a straight, smooth tube of 220 m along x with a portal at either end. Between
// the portals' surroundings nothing tells how far along one is.
#pragma once

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

WorldMesh MakeTunnel(int seed);

/// From outside one portal to outside the other, on the right lane: 260 m, not closed.
Route TunnelRoute();

}  // namespace covsplat
