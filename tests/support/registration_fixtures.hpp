// Short cuts from simulated scans to registration problems.
#pragma once

#include <vector>

#include "tests/support/ray_scene.hpp"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "covsplat/registration/gicp.hpp"

namespace covsplat::test {

/// Surfels of one source cloud at a pose, as if a mapper had taken each point as it is.
inline void AppendSurfels(const SourceCloud& cloud,
                          const SE3& T_map_sensor,
                          std::vector<TargetSurfel>& surfels) {
  for (std::size_t i = 0; i < cloud.Size(); ++i) {
    const Eigen::Matrix3d R =
        T_map_sensor.RotationMatrix() * cloud.covariance[i].axes.cast<double>();
    surfels.push_back({.mean = (T_map_sensor * cloud.points[i].cast<double>()).cast<float>(),
                       .rotation = Eigen::Quaterniond(R).cast<float>(),
                       .scale0 = cloud.covariance[i].sigma_m[0],
                       .scale1 = cloud.covariance[i].sigma_m[1]});
  }
}

/// A scan without motion, ready for registration.
inline SourceCloud PreprocessStill(const Scan& scan, ThreadPool& pool) {
  return Preprocess(scan, ScanTiming{}, ScanMotion{}, PreprocessConfig{}, pool);
}

/// A scan from a sensor at rest at `pose`.
inline SourceCloud StillCloud(const RayScene& scene,
                              const SE3& pose,
                              double noise_m,
                              std::uint64_t seed,
                              ThreadPool& pool,
                              const SensorModel& sensor = SimulatedSensor()) {
  const Motion still = [&](double) { return pose; };
  Scan scan = Simulate(scene, sensor, still, 0.0, noise_m, seed);
  scan.time_offset_s.clear();
  return PreprocessStill(scan, pool);
}

inline SE3 MakePose(double roll, double pitch, double yaw, double x, double y, double z) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX())),
          {x, y, z}};
}

/// The prediction "it is here and at rest", without a motion prior.
inline MotionPrediction At(const SE3& pose) {
  return {.motion = {.T_map_sensor = pose}, .horizon_s = 0.0};
}

inline double RotationError(const SE3& a, const SE3& b) {
  return (a.Inverse() * b).Log().head<3>().norm();
}
inline double TranslationError(const SE3& a, const SE3& b) {
  return (a.Translation() - b.Translation()).norm();
}

}  // namespace covsplat::test
