// The pictures of a map in the report of a run.
#pragma once

#include <vector>

#include "apps/run_results.hpp"

#include "covsplat/mapping/saved_map.hpp"

namespace covsplat {

/// From above, from the side, and panoramas along the path; none of an empty map.
std::vector<MapPicture> DrawMap(SlamSystem& system,
                                const SlamConfig& config,
                                const SavedMap& saved,
                                const RunResults& results);

}  // namespace covsplat
