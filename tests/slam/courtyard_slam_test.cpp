// Whole runs through the simulated courtyard with sensors that determine the motion within a scan
// less well than the demo's.
#include <cstdio>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/eval/trajectory_error.hpp"
#include "covsplat/sim/simulation.hpp"
#include "covsplat/slam/slam_system.hpp"

namespace covsplat::test {
namespace {

/// ATE of the walk's first scans, on the map as it was spawned.
double WalkAte(const SimulatedLidarConfig& lidar, int scans) {
  SimulationConfig config;
  config.lidar = lidar;
  config.max_scans = scans;
  const Simulation simulation = Simulation::Create(config).value();
  SlamConfig slam;
  slam.system.schedule = Schedule::kLockstep;
  slam.system.threads = 2;
  slam.mapper.feedback.mode = FeedbackMode::kFrozen;
  const auto system = SlamSystem::Create(slam, simulation.Sensor()).value();
  ThreadPool pool(2);
  Trajectory poses;
  for (int i = 0; i < scans; ++i) {
    const std::optional<ScanRecord> record = system->Process(simulation.MakeScan(i, pool));
    poses.push_back({record->stamp_s, record->T_map_sensor});
  }
  const TrajectoryError error = EvaluateTrajectory(poses, simulation.Truth(20.0));
  EXPECT_EQ(error.matched, poses.size());
  std::printf("ATE %.1f mm, at most %.1f mm\n",
              1e3 * error.ate_translation_m.rmse,
              1e3 * error.ate_translation_m.max);
  return error.ate_translation_m.rmse;
}

constexpr int kScans = kSanitized ? 5 : 150;

// In half the time and with fewer points a scan tells little of its acceleration; trusted too much,
// errors of it grow from scan to scan.
TEST(CourtyardSlam, KeepsTheWayAtTwentyScansPerSecond) {
  EXPECT_LT(WalkAte({.columns = 512, .scan_rate_hz = 20.0}, kScans), 0.01);
}

TEST(CourtyardSlam, KeepsTheWayWithSixteenBeams) {
  EXPECT_LT(
      WalkAte({.rows = 16, .columns = 1800, .elevation_low_deg = -15.0, .elevation_high_deg = 15.0},
              kScans),
      0.03);
}

}  // namespace
}  // namespace covsplat::test
