// The two rooms of the world "college": a hall and a parlour, furnished, each with a door to the
// first court and one between them.
#pragma once

#include <vector>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// Doorways of the rooms in the south wall of the first court, whose u is x.
std::vector<Opening> CollegeRoomDoors();

/// Everything behind that wall.
void AddCollegeRooms(MeshBuilder& mesh, Rng& rng);

}  // namespace covsplat
