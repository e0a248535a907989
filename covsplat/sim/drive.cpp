#include "covsplat/sim/drive.hpp"

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

constexpr double kSensorHeightM = 1.8;
constexpr double kFullSpeedMps = 10.0;

double Radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

// Speed along the way that a driver keeps: as fast as bends allow, braking in time.
class DrivingSpeed {
 public:
  DrivingSpeed(const Path& path, double length_m, Rng& rng) {
    const auto steps = static_cast<std::size_t>(std::ceil(length_m / kStepM)) + 1;
    const Wave mood_mps = WaveOfAnyPhase(1.3, rng.Uniform(0.006, 0.01), rng);  // by metres
    const double cruise_mps = rng.Uniform(9.8, 10.4);
    for (std::size_t i = 0; i < steps; ++i) {
      const double distance_m = kStepM * static_cast<double>(i);
      const double bend = path.Curvature(distance_m, kBendWindowM);
      speed_mps_.push_back(std::min(cruise_mps + mood_mps.At(distance_m),
                                    std::sqrt(kSidewaysMps2 / std::max(bend, 1e-6))));
    }
    speed_mps_.front() = speed_mps_.back() = kStartMps;
    for (std::size_t i = 1; i < steps; ++i) LimitBy(speed_mps_[i - 1], speed_mps_[i]);
    for (std::size_t i = steps - 1; i > 0; --i) LimitBy(speed_mps_[i], speed_mps_[i - 1]);
  }

  double At(double distance_m) const {
    const double position = distance_m / kStepM;
    const auto i = std::min(static_cast<std::size_t>(position), speed_mps_.size() - 2);
    const double s = std::min(position - static_cast<double>(i), 1.0);
    return speed_mps_[i] + s * (speed_mps_[i + 1] - speed_mps_[i]);
  }

 private:
  static constexpr double kStepM = 0.5;
  static constexpr double kBendWindowM = 4.0;
  static constexpr double kSidewaysMps2 = 3.0;
  static constexpr double kForwardMps2 = 1.4;
  static constexpr double kStartMps = 0.3;

  static void LimitBy(double neighbour, double& speed) {
    speed = std::min(speed, std::sqrt(neighbour * neighbour + 2.0 * kForwardMps2 * kStepM));
  }

  std::vector<double> speed_mps_;
};

struct Suspension {
  explicit Suspension(Rng& rng)
      : bounce_m(WaveOfAnyPhase(0.011, rng.Uniform(1.2, 1.5), rng)),
        roll_rad(WaveOfAnyPhase(Radians(0.4), rng.Uniform(0.8, 1.1), rng)),
        pitch_rad(WaveOfAnyPhase(Radians(0.3), rng.Uniform(1.0, 1.4), rng)),
        drift_m(WaveOfAnyPhase(0.08, rng.Uniform(0.05, 0.08), rng)) {}
  Wave bounce_m, roll_rad, pitch_rad;
  Wave drift_m;  // within the lane
};

SE3 VehiclePose(const Travel::State& state,
                const Suspension& suspension,
                double ground_m,
                double time_s) {
  const double heading = state.heading_rad;
  const double aside_m = state.vigour * suspension.drift_m.At(time_s);
  const Eigen::Vector3d position(
      state.ground.x() - aside_m * std::sin(heading),
      state.ground.y() + aside_m * std::cos(heading),
      ground_m + kSensorHeightM + state.vigour * suspension.bounce_m.At(time_s));
  const double pitch = state.vigour * suspension.pitch_rad.At(time_s) - std::atan(state.slope);
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(state.vigour * suspension.roll_rad.At(time_s), Eigen::Vector3d::UnitX());
  return {rotation, position};
}

}  // namespace

Motion Drive(const Route& route, int laps, int seed) {
  Rng rng(static_cast<std::uint64_t>(seed), 1);
  const Path path(Jittered(route, rng), route.closed);
  const double length_m = path.Length() * laps;
  const DrivingSpeed speed(path, length_m, rng);
  Travel travel(
      path, length_m, [&](double distance_m) { return speed.At(distance_m); }, kFullSpeedMps);
  const double duration_s = travel.Duration();
  const auto pose_at = [travel = std::move(travel),
                        suspension = Suspension(rng),
                        ground = route.ground](double time_s) {
    const Travel::State state = travel.At(time_s);
    const double ground_m = ground ? ground(state.ground.x(), state.ground.y()) : 0.0;
    return VehiclePose(state, suspension, ground_m + state.ground.z(), time_s);
  };
  return {duration_s, pose_at};
}

}  // namespace covsplat
