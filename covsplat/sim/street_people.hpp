// People on the pavements of streets.
#pragma once

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mover.hpp"

namespace covsplat {

/// Somebody who walks to and fro, `offset_m` outside the centre lines of the streets around the
/// block whose south-west crossing is at `origin`, from `from_m` along that ring on.
Mover Stroller(const Eigen::Vector2d& origin, double offset_m, double from_m, Rng& rng);

}  // namespace covsplat
