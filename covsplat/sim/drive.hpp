// A vehicle that carries the sensor.
#pragma once

#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

/// On the roof, 1.8 m above the road, at 8 to 12 m/s where the way is straight and slower where it
/// bends, with the small rolls and bounces of a suspension.
Motion Drive(const Route& route, int laps, int seed);

}  // namespace covsplat
