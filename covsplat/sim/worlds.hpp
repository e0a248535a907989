// The simulated worlds by name.
#pragma once

#include <span>
#include <string_view>

#include "covsplat/core/result.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// Names that MakeWorld and MakeMotion know.
std::span<const std::string_view> WorldNames();

/// The surfaces of a world, in metres, z up. The seed varies details (window depths, leaves,
/// plants), never the plan; the same seed gives the same triangles.
Result<WorldMesh> MakeWorld(std::string_view name, int seed);

}  // namespace covsplat
