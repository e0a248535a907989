// People who carry the sensor.
#pragma once

#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

/// In the hand, 1.5 m above the ground, at 1.2 to 1.4 m/s where the way is straight, with the
/// bounce and sway of a gait and looks to either side.
Motion Handheld(const Route& route, int laps, int seed);

/// On the back, 1.7 m above the ground: the same gait, steadier, looking ahead.
Motion Backpack(const Route& route, int laps, int seed);

}  // namespace covsplat
