// Scans of somebody walking with a sensor, their predictions, and the surfels of six other scans:
// what is prepared and registered in tests and benchmarks of tracking.
#pragma once

#include <vector>

#include "tests/support/registration_fixtures.hpp"

namespace covsplat::test {

inline constexpr double kWalkNoise = 0.02;
inline constexpr double kWalkStamp = 1.0;

inline Scan WalkScan(const SensorModel& sensor) {
  return Simulate(Room(), sensor, HandheldWalk, kWalkStamp, kWalkNoise);
}

/// As of a tracker, 5 cm and some hundredths of a radian off.
inline MotionPrediction WalkPrediction(double mid_stamp_s = kWalkStamp) {
  const SE3 before = HandheldWalk(mid_stamp_s - kScanPeriod);
  MotionPrediction prediction;
  prediction.motion.twist = (before.Inverse() * HandheldWalk(mid_stamp_s)).Log();
  prediction.motion.T_map_sensor =
      HandheldWalk(mid_stamp_s) * MakePose(0.01, 0.01, 0.02, 0.05, 0, 0);
  prediction.horizon_s = 0.3;
  return prediction;
}

inline PreprocessConfig Fine() {
  PreprocessConfig config;
  config.downsample_voxel_m = 0.3;
  return config;
}

inline std::vector<TargetSurfel> RoomSurfels(const SensorModel& sensor, ThreadPool& pool) {
  std::vector<TargetSurfel> surfels;
  for (int k = 0; k < 6; ++k) {
    const SE3 pose = HandheldWalk(3.0 * k);
    const auto seed = static_cast<std::uint64_t>(k);
    AppendSurfels(StillCloud(Room(), pose, kWalkNoise, seed, pool, sensor), pose, surfels);
  }
  return surfels;
}

}  // namespace covsplat::test
