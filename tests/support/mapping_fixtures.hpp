// Short cuts from simulated scans to keyframes, maps and runs of the whole system.
#pragma once

#include <cstdint>
#include <utility>

#include "tests/support/ray_scene.hpp"
#include "tests/support/registration_fixtures.hpp"

#include "covsplat/mapping/keyframe.hpp"

namespace covsplat::test {

// Sanitizers slow the code down by up to 20 times: tests shrink their scenes, not their claims.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// The simulated sensor with a quarter of its pixels: 32 x 512, +-45 deg.
inline SensorModel ReducedSensor() {
  return UniformSensorModel(32, 512, -0.25 * M_PI, 0.25 * M_PI, 0.5, 60.0);
}

/// What a tracker would hand over of a sensor at rest at a pose. Every point counts as matched.
inline TrackedScan TrackedStill(const RayScene& scene,
                                const SensorModel& sensor,
                                const SE3& T_map_sensor,
                                double noise_m,
                                std::uint64_t seed,
                                ThreadPool& pool) {
  const Motion still = [&](double) { return T_map_sensor; };
  Scan scan = Simulate(scene, sensor, still, 0.0, noise_m, seed);
  scan.time_offset_s.clear();
  SourceCloud source = PreprocessStill(scan, pool);
  TrackedScan tracked;
  tracked.T_odom_sensor = T_map_sensor;
  tracked.points = std::move(scan.points);
  tracked.surface = std::move(source.points);
  tracked.covariance = std::move(source.covariance);
  tracked.squared_distance.assign(tracked.surface.size(), 1e-4f);
  return tracked;
}

constexpr double kMaxSurfaceDistance = 0.5;

/// A keyframe of a sensor at rest.
inline Keyframe StillKeyframe(const RayScene& scene,
                              const SensorModel& sensor,
                              const SE3& T_map_sensor,
                              double noise_m,
                              std::uint64_t seed,
                              ThreadPool& pool) {
  return MakeKeyframe(TrackedStill(scene, sensor, T_map_sensor, noise_m, seed, pool),
                      sensor,
                      kMaxSurfaceDistance,
                      pool);
}

/// A keyframe of ReducedSensor() that measured the same range in every pixel, 0: nothing.
inline Keyframe SphereKeyframe(const SE3& T_map_sensor, float range_m) {
  const SensorModel sensor = ReducedSensor();
  Keyframe keyframe;
  keyframe.tracked.T_odom_sensor = T_map_sensor;
  keyframe.measurement = {
      Image<float>(sensor.Rows(), sensor.Columns(), range_m),
      Image<Eigen::Vector3f>(sensor.Rows(), sensor.Columns(), Eigen::Vector3f::Zero())};
  return keyframe;
}

/// True ranges of the sensor's rays from a pose, 0 where there is nothing in its reach.
inline Image<float> TrueRanges(const RayScene& scene, const SensorModel& sensor, const SE3& pose) {
  Image<float> ranges(sensor.Rows(), sensor.Columns(), 0.0f);
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const Eigen::Vector3d ray = sensor.RayOf(row, column).cast<double>().normalized();
      const double range = scene.Cast(pose.Translation(), pose.Rotation() * ray);
      if (range > sensor.MinRange() && range < sensor.MaxRange()) {
        ranges(row, column) = static_cast<float>(range);
      }
    }
  }
  return ranges;
}

/// Mean |rendered - expected| over the pixels that have a return; a pixel that is rendered empty is
/// off by all of its range, so that holes cannot look like a good map.
inline double MeanRangeError(const Image<float>& rendered, const Image<float>& expected) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < expected.Size(); ++i) {
    if (!(expected.Pixels()[i] > 0.0f)) continue;
    sum += std::abs(static_cast<double>(rendered.Pixels()[i]) - expected.Pixels()[i]);
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace covsplat::test
