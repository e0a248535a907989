// Trajectory: timed poses of the sensor.
#pragma once

#include <optional>
#include <vector>

#include "covsplat/core/se3.hpp"

namespace covsplat {

/// The sensor's pose at one time. World is the map frame of a run, or the ground truth's own frame.
struct TimedPose {
  double stamp_s = 0.0;
  SE3 T_world_sensor;
};

/// In order of time.
using Trajectory = std::vector<TimedPose>;

/// Pose at a time between two samples (geodesic), or nothing outside the trajectory or where the
/// neighbouring samples are more than `max_gap_s` apart.
std::optional<SE3> PoseAt(const Trajectory& trajectory, double stamp_s, double max_gap_s);

}  // namespace covsplat
