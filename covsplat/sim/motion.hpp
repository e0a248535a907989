// Motion: how the sensor moves through a simulated world.
#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <utility>

#include "covsplat/core/result.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/sim/path.hpp"

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

/// A way to move along a route.
struct MotionKind {
  std::string_view name;
  std::string_view description;
  Motion (*make)(const Route& route, int laps, int seed);
};

std::span<const MotionKind> MotionKinds();

/// Starts and ends standing still; after whole laps of a closed route at the same pose. Positions
/// are twice continuously differentiable. Laps of an open route, and routes too short to move
/// along, are errors.
Result<Motion> MakeMotion(std::string_view name, const Route& route, int laps, int seed);

/// The motion of a recorded trajectory, smoothed by a cubic B-spline of its poses; starts at time 0
/// with its first pose. Needs two poses or more.
Motion MotionAlong(const Trajectory& trajectory);

}  // namespace covsplat
