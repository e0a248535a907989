// What two trajectories look like that do not fit: other clocks, other units.
#pragma once

#include <optional>
#include <string>

#include "covsplat/core/trajectory.hpp"
#include "covsplat/eval/trajectory_error.hpp"

namespace covsplat {

/// Why no pose, or hardly one, of the estimate has a truth at its time, as a clause for people: the
/// spans of both, and what they look like (nanoseconds, milliseconds, a clock that starts at zero).
/// Neither may be empty.
std::string ExplainNoOverlap(const Trajectory& estimate, const Trajectory& truth);

/// What is odd about matched poses: paths a thousandfold apart in length, or few poses with a
/// truth.
std::optional<std::string> OddMatch(const Trajectory& estimate,
                                    const Trajectory& truth,
                                    const TrajectoryError& error);

}  // namespace covsplat
