// RayScene: analytic boxes to cast rays at, and a spinning sensor that moves while it measures.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/sensor_model.hpp"

namespace covsplat::test {

/// Axis-aligned box. Rays hit it from outside (an obstacle) or from inside (a room). A side at
/// infinity is not there.
struct Box {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

class RayScene {
 public:
  explicit RayScene(std::vector<Box> boxes) : boxes_(std::move(boxes)) {}

  void Add(const Box& box) { boxes_.push_back(box); }

  /// Distance along a unit ray to the first surface, infinity if there is none.
  double Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const {
    double nearest = kInfinity;
    for (const Box& box : boxes_) {
      double enter = -kInfinity;
      double leave = kInfinity;
      for (int k = 0; k < 3; ++k) {
        const double inverse = 1.0 / ray[k];
        const double a = (box.low[k] - origin[k]) * inverse;
        const double b = (box.high[k] - origin[k]) * inverse;
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
      }
      if (leave < std::max(enter, 0.0)) continue;
      nearest = std::min(nearest, enter > 0.0 ? enter : leave);
    }
    return nearest;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<Box> boxes_;
};

/// 24 x 18 x 6 m with pillars, crates and a step in one wall.
inline RayScene Room() {
  return RayScene({{{-12, -9, -1.5}, {12, 9, 4.5}},
                   {{-6, -5, -1.5}, {-5.4, -4.4, 4.5}},
                   {{5, 4, -1.5}, {5.6, 4.6, 4.5}},
                   {{3, -7, -1.5}, {6, -5.5, 0.2}},
                   {{-9, 3, -1.5}, {-7.5, 6, 1.0}},
                   {{9, -3, -1.5}, {12, 2, 2.0}},
                   {{-2, 7.5, -1.5}, {1, 9, 1.5}}});
}

/// Endless along x.
inline RayScene Corridor() { return RayScene({{{-1e4, -1.5, -1.2}, {1e4, 1.5, 1.8}}}); }

/// Floor only, 1.5 m below.
inline RayScene Floor() { return RayScene({{{-1e4, -1e4, -10}, {1e4, 1e4, -1.5}}}); }

/// 64 x 1024, +-45 deg.
inline SensorModel SimulatedSensor() {
  return UniformSensorModel(64, 1024, -0.25 * M_PI, 0.25 * M_PI, 0.5, 60.0);
}

using Motion = std::function<SE3(double stamp_s)>;

constexpr double kScanPeriod = 0.1;

/// One turn with its middle at `mid_stamp_s`; every column is cast from the sensor's exact pose at
/// its time. Points carry their times; `stamp_s` is the begin of the turn.
inline Scan Simulate(const RayScene& scene,
                     const SensorModel& sensor,
                     const Motion& T_world_sensor,
                     double mid_stamp_s,
                     double noise_m,
                     std::uint64_t seed = 1) {
  Scan scan;
  scan.stamp_s = mid_stamp_s - 0.5 * kScanPeriod;
  for (int column = 0; column < sensor.Columns(); ++column) {
    const double offset = (column + 0.5) / sensor.Columns() * kScanPeriod;
    const SE3 pose = T_world_sensor(scan.stamp_s + offset);
    Rng rng(seed, static_cast<std::uint64_t>(column));
    for (int row = 0; row < sensor.Rows(); ++row) {
      const Eigen::Vector3d ray = sensor.RayOf(row, column).cast<double>().normalized();
      const double range = scene.Cast(pose.Translation(), pose.Rotation() * ray);
      const double measured = range + noise_m * rng.Normal();
      if (!(measured > sensor.MinRange() && measured < sensor.MaxRange())) continue;
      scan.points.push_back((measured * ray).cast<float>());
      scan.time_offset_s.push_back(static_cast<float>(offset));
    }
  }
  return scan;
}

/// The same points as if measured at once at mid scan, by the true motion.
inline Scan TrulyDeskewed(const Scan& scan, const Motion& T_world_sensor, double mid_stamp_s) {
  Scan deskewed = scan;
  deskewed.time_offset_s.clear();
  deskewed.stamp_s = mid_stamp_s;
  const SE3 T_mid_world = T_world_sensor(mid_stamp_s).Inverse();
  SE3 pose;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const float offset = scan.time_offset_s[i];
    if (i == 0 || offset != scan.time_offset_s[i - 1]) {
      pose = T_mid_world * T_world_sensor(scan.stamp_s + static_cast<double>(offset));
    }
    deskewed.points[i] = (pose * scan.points[i].cast<double>()).cast<float>();
  }
  return deskewed;
}

/// Somebody walking a loop of about 1.5 m/s in the room with a sensor in hand: 2 Hz steps of +-2 cm
/// and sways of several degrees about all axes.
inline SE3 HandheldWalk(double t) {
  const double around = 0.3 * t;  // rad along the loop
  const Eigen::Vector3d position(5.0 * std::cos(around),
                                 4.0 * std::sin(around) + 0.03 * std::sin(2 * M_PI * 1.0 * t),
                                 0.02 * std::sin(2 * M_PI * 2.0 * t));
  const double heading = std::atan2(4.0 * std::cos(around), -5.0 * std::sin(around));
  const double yaw = heading + 0.07 * std::sin(2 * M_PI * 1.0 * t + 0.4);
  const double pitch = 0.05 * std::sin(2 * M_PI * 2.0 * t + 1.0);
  const double roll = 0.06 * std::sin(2 * M_PI * 1.3 * t + 2.0);
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()));
  return {rotation, position};
}

}  // namespace covsplat::test
