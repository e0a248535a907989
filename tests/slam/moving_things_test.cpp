// Simulated streets, whose points say whether they are of something that moves.
#include <cstdio>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/mapping/reliability.hpp"
#include "covsplat/sim/simulation.hpp"

namespace covsplat::test {
namespace {

constexpr int kScans = kSanitized ? 30 : 90;
constexpr int kScansPerKeyframe = 3;

struct Counts {
  double moving = 0.0;
  double found = 0.0;
  double wrong = 0.0;
  double all = 0.0;

  double Recall() const { return found / moving; }
  double Precision() const { return found / (found + wrong); }
};

/// Scans at their true poses, each judged by the keyframes before it.
Counts JudgeStreet(int seed) {
  SimulationConfig config;
  config.world = "street";
  config.seed = seed;
  config.lidar.rows = 32;
  config.lidar.columns = 1024;
  config.max_scans = kScans;
  const Simulation simulation = Simulation::Create(config).value();
  const SensorModel sensor = simulation.Sensor();
  ThreadPool pool(2);
  FreeSpace space(sensor, {});
  Counts counts;
  for (int i = 0; i < kScans; i += kScansPerKeyframe) {
    const Scan scan = Deskewed(simulation.MakeScan(i, pool), simulation.SensorMotion());
    Keyframe keyframe;
    keyframe.tracked.T_odom_sensor = simulation.PoseOf(i);
    keyframe.measurement.range_m = ProjectScan(sensor, scan.points).range_m;
    const std::vector<std::uint8_t> moved =
        space.FindMoved(scan.points, keyframe.tracked.T_odom_sensor, pool);
    space.Remember(keyframe);
    for (std::size_t k = 0; k < moved.size(); ++k) {
      const bool moves = scan.label[k] != 0;
      counts.all += 1.0;
      counts.moving += moves;
      counts.found += moves && moved[k] != 0;
      counts.wrong += !moves && moved[k] != 0;
    }
  }
  return counts;
}

TEST(MovingThings, AreToldFromWhatStandsStill) {
  for (const int seed : {1, 2}) {
    const Counts counts = JudgeStreet(seed);
    std::printf("street %d: %.2f %% of the points move; precision %.3f, recall %.3f\n",
                seed,
                100.0 * counts.moving / counts.all,
                counts.Precision(),
                counts.Recall());
    ASSERT_GT(counts.moving, 1000.0);
    EXPECT_GT(counts.Precision(), 0.8);
    EXPECT_GT(counts.Recall(), 0.6);
  }
}

}  // namespace
}  // namespace covsplat::test
