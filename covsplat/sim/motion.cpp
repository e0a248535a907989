#include "covsplat/sim/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/courtyard.hpp"

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSensorHeightM = 1.5;
constexpr double kKnotS = 0.25;
constexpr int kStandingKnots = 6;  // a cubic rests for three fewer: 0.75 s

constexpr std::array<std::string_view, 1> kNames = {"handheld"};

double Radians(double degrees) { return degrees * kPi / 180.0; }

// Uniform cubic B-spline at `position` knots; ends extend as constants where the controls rest.
template <class Vector, class ControlAt>
Vector CubicBSpline(double position, const ControlAt& control_at) {
  const double floor = std::floor(position);
  const double s = position - floor;
  const auto knot = static_cast<std::ptrdiff_t>(floor);
  const double r = 1.0 - s;
  return (r * r * r * control_at(knot) +
          (4.0 - 6.0 * s * s + 3.0 * s * s * s) * control_at(knot + 1) +
          (4.0 - 6.0 * r * r + 3.0 * r * r * r) * control_at(knot + 2) +
          s * s * s * control_at(knot + 3)) /
         6.0;
}

// A closed path in the plane by arc length.
class ClosedPath {
 public:
  explicit ClosedPath(const std::vector<Eigen::Vector2d>& controls) {
    const auto n = static_cast<std::ptrdiff_t>(controls.size());
    const auto control_at = [&](std::ptrdiff_t i) -> const Eigen::Vector2d& {
      return controls[static_cast<std::size_t>(i % n)];
    };
    const auto samples = n * kSamplesPerControl;
    for (std::ptrdiff_t i = 0; i <= samples; ++i) {
      const double position = static_cast<double>(i % samples) / kSamplesPerControl;
      const auto point = CubicBSpline<Eigen::Vector2d>(position, control_at);
      distance_m_.push_back(points_.empty() ? 0.0
                                            : distance_m_.back() + (point - points_.back()).norm());
      points_.push_back(point);
    }
  }

  double Length() const { return distance_m_.back(); }

  Eigen::Vector2d At(double distance_m) const {
    const double wrapped = distance_m - Length() * std::floor(distance_m / Length());
    const auto after = std::upper_bound(distance_m_.begin() + 1, distance_m_.end() - 1, wrapped);
    const auto i = static_cast<std::size_t>(after - distance_m_.begin());
    const double s = (wrapped - distance_m_[i - 1]) / (distance_m_[i] - distance_m_[i - 1]);
    return points_[i - 1] + s * (points_[i] - points_[i - 1]);
  }

  /// Direction of travel over half a metre, in (-pi, pi].
  double Heading(double distance_m) const {
    const Eigen::Vector2d ahead = At(distance_m + 0.25) - At(distance_m - 0.25);
    return std::atan2(ahead.y(), ahead.x());
  }

  /// How fast the heading turns, rad/m, unsigned.
  double Curvature(double distance_m) const {
    return std::abs(
        std::remainder(Heading(distance_m + 0.5) - Heading(distance_m - 0.5), 2.0 * kPi));
  }

 private:
  static constexpr int kSamplesPerControl = 200;
  std::vector<Eigen::Vector2d> points_;
  std::vector<double> distance_m_;
};

// Per knot: x, y, heading (unwrapped), strength of the gait from 0 to 1.
using Controls = std::vector<Eigen::Vector4d>;

// Speed in m/s along the path: less in turns, where the walker looks at something, and at both
// ends.
class SpeedProfile {
 public:
  SpeedProfile(double length_m, Rng& rng) : length_m_(length_m), cruise_(rng.Uniform(1.28, 1.38)) {
    for (const double share : {0.2, 0.45, 0.8}) {
      pauses_m_.push_back(length_m * (share + rng.Uniform(-0.06, 0.06)));
    }
  }

  double At(const ClosedPath& path, double distance_m) const {
    constexpr double kAcceleration = 0.7;
    double speed = cruise_ * (1.0 - 0.3 * std::min(1.0, path.Curvature(distance_m) / 0.5));
    for (const double pause_m : pauses_m_) {
      const double off = (distance_m - pause_m) / 1.5;
      speed *= 1.0 - 0.45 * std::exp(-off * off);
    }
    const double to_end_m = std::min(distance_m, length_m_ - distance_m);
    return std::min(speed, std::sqrt(0.04 + 2.0 * kAcceleration * std::max(0.0, to_end_m)));
  }

 private:
  double length_m_;
  double cruise_;
  std::vector<double> pauses_m_;
};

Controls WalkOnce(const ClosedPath& path, Rng& rng) {
  const SpeedProfile profile(path.Length(), rng);
  Controls controls;
  double heading = path.Heading(0.0);
  const auto step_to = [&](double distance_m, double gait) {
    heading += std::remainder(path.Heading(distance_m) - heading, 2.0 * kPi);
    const Eigen::Vector2d point = path.At(distance_m);
    controls.emplace_back(point.x(), point.y(), heading, gait);
  };
  for (int i = 0; i < kStandingKnots; ++i) step_to(0.0, 0.0);
  double distance_m = 0.0;
  while (true) {
    const double speed = profile.At(path, distance_m);
    distance_m += speed * kKnotS;
    if (distance_m >= path.Length()) break;
    step_to(distance_m, std::clamp(speed / 1.1, 0.0, 1.0));
  }
  for (int i = 0; i < kStandingKnots; ++i) step_to(path.Length(), 0.0);
  return controls;
}

// A sinusoid in time.
struct Wave {
  double amplitude = 0.0;
  double frequency_hz = 0.0;
  double phase = 0.0;
  double At(double time_s) const {
    return amplitude * std::sin(2.0 * kPi * frequency_hz * time_s + phase);
  }
};

// A step is half a stride: the body bounces with steps and sways with strides.
struct Gait {
  explicit Gait(Rng& rng) {
    const double step_hz = rng.Uniform(1.85, 2.05);
    const auto wave = [&](double amplitude, double frequency_hz) {
      return Wave{amplitude, frequency_hz, rng.Uniform(0.0, 2.0 * kPi)};
    };
    bounce_m = wave(rng.Uniform(0.020, 0.030), step_hz);
    sway_m = wave(0.020, 0.5 * step_hz);
    roll_rad = wave(Radians(rng.Uniform(2.0, 3.0)), 0.5 * step_hz);
    pitch_rad = wave(Radians(rng.Uniform(2.0, 2.5)), step_hz);
    yaw_rad = wave(Radians(4.0), 0.5 * step_hz);
    look_rad = wave(Radians(14.0), rng.Uniform(0.09, 0.13));
    glance_rad = wave(Radians(7.0), rng.Uniform(0.2, 0.3));
  }
  Wave bounce_m, sway_m, roll_rad, pitch_rad, yaw_rad, look_rad, glance_rad;
};

using Ground = std::function<double(double, double)>;

SE3 WalkerPose(const Controls& controls, const Gait& gait, const Ground& ground, double time_s) {
  const auto last = static_cast<std::ptrdiff_t>(controls.size()) - 1;
  const auto control_at = [&](std::ptrdiff_t i) -> const Eigen::Vector4d& {
    return controls[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, last))];
  };
  const auto state = CubicBSpline<Eigen::Vector4d>(time_s / kKnotS, control_at);
  const double heading = state(2);
  const double strength = state(3);
  const double sway_m = strength * gait.sway_m.At(time_s);
  const Eigen::Vector3d position(
      state(0) - sway_m * std::sin(heading),
      state(1) + sway_m * std::cos(heading),
      ground(state(0), state(1)) + kSensorHeightM + strength * gait.bounce_m.At(time_s));
  const double yaw = heading + strength * (gait.yaw_rad.At(time_s) + gait.look_rad.At(time_s) +
                                           gait.glance_rad.At(time_s));
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(strength * gait.pitch_rad.At(time_s), Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(strength * gait.roll_rad.At(time_s), Eigen::Vector3d::UnitX());
  return {rotation, position};
}

Motion Handheld(std::vector<Eigen::Vector2d> route, Ground ground, int seed) {
  Rng rng(static_cast<std::uint64_t>(seed), 1);
  for (Eigen::Vector2d& point : route) {
    point += Eigen::Vector2d(rng.Uniform(-0.1, 0.1), rng.Uniform(-0.1, 0.1));
  }
  Controls controls = WalkOnce(ClosedPath(route), rng);
  const double duration_s = kKnotS * static_cast<double>(controls.size() - 3);
  const auto pose_at =
      [controls = std::move(controls), gait = Gait(rng), ground = std::move(ground)](
          double time_s) { return WalkerPose(controls, gait, ground, time_s); };
  return {duration_s, pose_at};
}

}  // namespace

std::span<const std::string_view> MotionNames() { return kNames; }

Result<Motion> MakeMotion(std::string_view world, std::string_view name, int seed) {
  if (world != "courtyard") {
    return Fail(ErrorCode::kUsage, "there is no way through a world '{}'; known: courtyard", world);
  }
  if (name != "handheld") {
    return Fail(ErrorCode::kUsage, "unknown motion '{}'; known: {}", name, fmt::join(kNames, ", "));
  }
  return Handheld(CourtyardRoute(), CourtyardGround, seed);
}

}  // namespace covsplat
