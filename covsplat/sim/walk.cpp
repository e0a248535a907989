#include "covsplat/sim/walk.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/travel.hpp"
#include "covsplat/sim/wave.hpp"

namespace covsplat {
namespace {

double Radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

struct Limits {
  double low = 0.0;
  double high = 0.0;
};

// How the sensor is carried.
struct Carriage {
  double height_m = 1.5;
  Limits bounce_m;
  double sway_m = 0.0;
  Limits roll_deg;
  Limits pitch_deg;
  double yaw_deg = 0.0;
  double look_deg = 0.0;
  double glance_deg = 0.0;
};

constexpr Carriage kInTheHand{1.5, {0.020, 0.030}, 0.020, {2.0, 3.0}, {2.0, 2.5}, 4.0, 14.0, 7.0};
constexpr Carriage kOnTheBack{1.7, {0.012, 0.018}, 0.012, {0.8, 1.2}, {0.8, 1.2}, 1.5, 3.0, 1.0};

// A step is half a stride: the body bounces with steps and sways with strides.
struct Gait {
  Gait(const Carriage& carriage, Rng& rng) {
    const double step_hz = rng.Uniform(1.85, 2.05);
    const auto draw = [&](const Limits& limits) { return rng.Uniform(limits.low, limits.high); };
    const auto wave = [&](double amplitude, double frequency_hz) {
      return WaveOfAnyPhase(amplitude, frequency_hz, rng);
    };
    bounce_m = wave(draw(carriage.bounce_m), step_hz);
    sway_m = wave(carriage.sway_m, 0.5 * step_hz);
    roll_rad = wave(Radians(draw(carriage.roll_deg)), 0.5 * step_hz);
    pitch_rad = wave(Radians(draw(carriage.pitch_deg)), step_hz);
    yaw_rad = wave(Radians(carriage.yaw_deg), 0.5 * step_hz);
    look_rad = wave(Radians(carriage.look_deg), rng.Uniform(0.09, 0.13));
    glance_rad = wave(Radians(carriage.glance_deg), rng.Uniform(0.2, 0.3));
  }
  Wave bounce_m, sway_m, roll_rad, pitch_rad, yaw_rad, look_rad, glance_rad;
};

// Speed in m/s along the path: less in turns, where the walker looks at something, and at both
// ends.
class WalkingSpeed {
 public:
  WalkingSpeed(double length_m, Rng& rng) : length_m_(length_m), cruise_(rng.Uniform(1.28, 1.38)) {
    for (const double share : {0.2, 0.45, 0.8}) {
      pauses_m_.push_back(length_m * (share + rng.Uniform(-0.06, 0.06)));
    }
  }

  double At(const Path& path, double distance_m) const {
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

SE3 WalkerPose(const Travel::State& state, const Gait& gait, double eye_m, double time_s) {
  const double heading = state.heading_rad;
  const double strength = state.vigour;
  const double sway_m = strength * gait.sway_m.At(time_s);
  const Eigen::Vector3d position(state.ground.x() - sway_m * std::sin(heading),
                                 state.ground.y() + sway_m * std::cos(heading),
                                 eye_m + strength * gait.bounce_m.At(time_s));
  const double yaw = heading + strength * (gait.yaw_rad.At(time_s) + gait.look_rad.At(time_s) +
                                           gait.glance_rad.At(time_s));
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(strength * gait.pitch_rad.At(time_s), Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(strength * gait.roll_rad.At(time_s), Eigen::Vector3d::UnitX());
  return {rotation, position};
}

Motion Walk(const Route& route, int laps, int seed, const Carriage& carriage) {
  Rng rng(static_cast<std::uint64_t>(seed), 1);
  const Path path(Jittered(route, rng), route.closed);
  const double length_m = path.Length() * laps;
  const WalkingSpeed speed(length_m, rng);
  Travel travel(
      path, length_m, [&](double distance_m) { return speed.At(path, distance_m); }, 1.1);
  const double duration_s = travel.Duration();
  const auto pose_at = [travel = std::move(travel),
                        gait = Gait(carriage, rng),
                        ground = route.ground,
                        height_m = carriage.height_m](double time_s) {
    const Travel::State state = travel.At(time_s);
    const double ground_m = ground ? ground(state.ground.x(), state.ground.y()) : 0.0;
    return WalkerPose(state, gait, ground_m + state.ground.z() + height_m, time_s);
  };
  return {duration_s, pose_at};
}

}  // namespace

Motion Handheld(const Route& route, int laps, int seed) {
  return Walk(route, laps, seed, kInTheHand);
}

Motion Backpack(const Route& route, int laps, int seed) {
  return Walk(route, laps, seed, kOnTheBack);
}

}  // namespace covsplat
