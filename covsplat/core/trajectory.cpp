#include "covsplat/core/trajectory.hpp"

#include <algorithm>

namespace covsplat {

std::optional<SE3> PoseAt(const Trajectory& trajectory, double stamp_s, double max_gap_s) {
  const auto after = std::lower_bound(
      trajectory.begin(), trajectory.end(), stamp_s, [](const TimedPose& pose, double stamp) {
        return pose.stamp_s < stamp;
      });
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp_s == stamp_s) return after->T_world_sensor;
  if (after == trajectory.begin()) return std::nullopt;
  const TimedPose& before = *(after - 1);
  const double gap_s = after->stamp_s - before.stamp_s;
  if (gap_s > max_gap_s) return std::nullopt;
  return Interpolate(
      before.T_world_sensor, after->T_world_sensor, (stamp_s - before.stamp_s) / gap_s);
}

}  // namespace covsplat
