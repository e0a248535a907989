// Motion: how the sensor moves through a simulated world.
#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <utility>

#include "covsplat/core/result.hpp"
#include "covsplat/core/se3.hpp"

namespace covsplat {

/// A pose for every time, from 0 to Duration() and, standing still, beyond.
class Motion {
 public:
  Motion(double duration_s, std::function<SE3(double)> pose_at)
      : duration_s_(duration_s), pose_at_(std::move(pose_at)) {}

  double Duration() const { return duration_s_; }
  /// T_world_sensor; safe to call from any number of threads.
  SE3 PoseAt(double time_s) const { return pose_at_(time_s); }

 private:
  double duration_s_;
  std::function<SE3(double)> pose_at_;
};

/// Names of the ways to move.
std::span<const std::string_view> MotionNames();

/// "handheld": a person walks once round the world, at 1.2 to 1.4 m/s where the way is straight,
/// the sensor 1.5 m above the ground, with the bounce and sway of a gait and looks to either side.
/// The walk starts and ends standing still at the same pose. The path is a cubic B-spline in time,
/// so velocity and acceleration are continuous.
Result<Motion> MakeMotion(std::string_view world, std::string_view name, int seed);

}  // namespace covsplat
