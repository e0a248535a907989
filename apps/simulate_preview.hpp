// A picture of a simulated world.
#pragma once

#include <cstdint>
#include <vector>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/sim/simulation.hpp"

namespace covsplat {

/// A PNG of all that is around the sensor at one time of its way, over a full turn and 100 degrees
/// of elevation: reflectivity, lit from above, paler with distance; things that move in red.
Result<std::vector<std::uint8_t>> PreviewPng(const Simulation& simulation,
                                             double time_s,
                                             ThreadPool& pool);

}  // namespace covsplat
