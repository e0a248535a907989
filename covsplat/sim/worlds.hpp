// The simulated worlds by name.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/mover.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

/// One row of the table of worlds. The seed varies details (window depths, leaves, plants, houses),
/// never the plan; the same seed gives the same triangles.
struct WorldKind {
  std::string_view name;
  std::string_view description;
  std::string_view default_motion;
  WorldMesh (*mesh)(int seed);  ///< what stands still: metres, z up
  Route (*route)();
  std::vector<Mover> (*movers)(int seed);
};

std::span<const WorldKind> Worlds();

/// The error names the known ones.
Result<WorldKind> FindWorld(std::string_view name);

}  // namespace covsplat
