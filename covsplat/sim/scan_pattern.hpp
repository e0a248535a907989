// ScanPattern: in which direction a LiDAR looks when.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "covsplat/sim/lidar_config.hpp"

namespace covsplat {

/// A scan is a number of firings, evenly spaced in time, each of the same number of rays that leave
/// at once.
class ScanPattern {
 public:
  explicit ScanPattern(const SimulatedLidarConfig& config);

  int Firings() const { return firings_; }
  int RaysPerFiring() const { return rays_; }

  /// Time of a firing from the stamp of its scan, in seconds.
  float TimeOffset(int firing) const;
  /// Unit direction in the sensor frame. A spinning LiDAR fires columns, clockwise from the rear,
  /// top ray first; every scan is alike. A rosette differs from scan to scan.
  Eigen::Vector3f Ray(int scan, int firing, int ray) const;

 private:
  std::optional<SensorModel> spinning_;
  RosettePattern rosette_;
  double scan_rate_hz_;
  int firings_;
  int rays_;
};

}  // namespace covsplat
