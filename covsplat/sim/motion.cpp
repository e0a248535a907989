#include "covsplat/sim/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "covsplat/core/check.hpp"
#include "covsplat/sim/drive.hpp"
#include "covsplat/sim/walk.hpp"

namespace covsplat {
namespace {

constexpr std::array kKinds = {
    MotionKind{"handheld", "in a walker's hand, 1.3 m/s, bouncing and looking about", Handheld},
    MotionKind{"walking", "on a walker's back, 1.3 m/s, steadier", Backpack},
    MotionKind{"vehicle", "on a car's roof, up to 12 m/s", Drive},
};

// Position and quaternion side by side, so that a spline can blend them.
using PoseControl = Eigen::Matrix<double, 7, 1>;

std::vector<PoseControl> ResampledPoses(const Trajectory& trajectory, double knot_s) {
  const double start_s = trajectory.front().stamp_s;
  const double length_s = trajectory.back().stamp_s - start_s;
  const auto knots = std::max<std::ptrdiff_t>(1, std::llround(length_s / knot_s));
  std::vector<PoseControl> controls;
  for (std::ptrdiff_t i = 0; i <= knots; ++i) {
    const double stamp_s =
        i == knots ? trajectory.back().stamp_s
                   : start_s + length_s * static_cast<double>(i) / static_cast<double>(knots);
    const auto pose = PoseAt(trajectory, stamp_s, length_s + 1.0);
    COVSPLAT_CHECK(pose.has_value());
    PoseControl control;
    control << pose->Translation(), pose->Rotation().coeffs();
    // Of the two quaternions of a rotation, the one nearer to the last.
    if (!controls.empty() && controls.back().tail<4>().dot(control.tail<4>()) < 0.0) {
      control.tail<4>() *= -1.0;
    }
    controls.push_back(control);
  }
  return controls;
}

}  // namespace

std::span<const MotionKind> MotionKinds() { return kKinds; }

Result<Motion> MakeMotion(std::string_view name, const Route& route, int laps, int seed) {
  if (laps < 1 || (laps > 1 && !route.closed)) {
    return Fail(ErrorCode::kUsage,
                "{} laps of this route cannot be: it does not end where it begins, so choose 1",
                laps);
  }
  if (route.controls.size() < (route.closed ? 4u : 2u)) {
    return Fail(ErrorCode::kUsage,
                "a route needs {} points or more; this one has {}",
                route.closed ? 4 : 2,
                route.controls.size());
  }
  for (const MotionKind& kind : kKinds) {
    if (kind.name == name) return kind.make(route, laps, seed);
  }
  std::vector<std::string_view> names;
  for (const MotionKind& kind : kKinds) names.push_back(kind.name);
  return Fail(ErrorCode::kUsage, "unknown motion '{}'; known: {}", name, fmt::join(names, ", "));
}

Motion MotionAlong(const Trajectory& trajectory) {
  COVSPLAT_CHECK(trajectory.size() >= 2);
  const double length_s = trajectory.back().stamp_s - trajectory.front().stamp_s;
  // Knots about as dense as the poses; half a second where those are rare.
  const double knot_s =
      std::clamp(length_s / static_cast<double>(trajectory.size() - 1), 0.02, 0.5);
  std::vector<PoseControl> controls = ResampledPoses(trajectory, knot_s);
  const double exact_knot_s = length_s / static_cast<double>(controls.size() - 1);
  const auto pose_at = [controls = std::move(controls), exact_knot_s](double time_s) {
    const auto last = static_cast<std::ptrdiff_t>(controls.size()) - 1;
    const auto control_at = [&](std::ptrdiff_t i) -> const PoseControl& {
      return controls[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, last))];
    };
    // The spline passes near control i at knot i - 1.
    const double knot =
        std::clamp(time_s / exact_knot_s - 1.0, -3.0, static_cast<double>(last) + 1.0);
    const auto blended = CubicBSpline<PoseControl>(knot, control_at);
    const Eigen::Quaterniond rotation(blended(6), blended(3), blended(4), blended(5));
    return SE3(rotation.normalized(), blended.head<3>());
  };
  return {length_s, pose_at};
}

}  // namespace covsplat
