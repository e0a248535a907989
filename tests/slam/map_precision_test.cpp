// What the map files' rounding costs: a map is made, saved, read and rendered at scans that it was
// not made of.
#include <cstdio>
#include <utility>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/mapping/compact_map.hpp"
#include "covsplat/mapping/held_out.hpp"
#include "covsplat/mesh/surfel_map.hpp"
#include "covsplat/sim/simulation.hpp"
#include "covsplat/slam/slam_system.hpp"

namespace covsplat::test {
namespace {

constexpr int kScans = kSanitized ? 6 : 40;

std::unique_ptr<SlamSystem> WalkThroughCourtyard() {
  SimulationConfig config;
  config.lidar.rows = 32;
  config.lidar.columns = 512;
  config.max_scans = kScans;
  const Simulation simulation = Simulation::Create(config).value();
  SlamConfig slam;
  slam.system.schedule = Schedule::kLockstep;
  slam.system.threads = 2;
  slam.system.held_out_interval = 3;
  auto system = SlamSystem::Create(slam, simulation.Sensor()).value();
  ThreadPool pool(2);
  for (int i = 0; i < kScans; ++i) system->Process(simulation.MakeScan(i, pool));
  system->Finish();
  return system;
}

SurfelMap SurfelsOf(const SavedMap& saved, const GaussianMap& map) {
  SurfelMap surfels;
  surfels.gaussians = saved.gaussians;
  surfels.keyframe = saved.keyframe;
  surfels.confidence = saved.confidence;
  surfels.intensity = saved.intensity;
  for (int k = 0; k < map.Keyframes(); ++k) surfels.T_map_keyframe.push_back(map.KeyframePose(k));
  return surfels;
}

struct Means {
  double error_m = 0.0;
  double median_error_m = 0.0;
  double coverage = 0.0;
};

Means HeldOutMeans(const SavedMap& saved, const SlamSystem& system, ThreadPool& pool) {
  const auto engine = MakeMapEngine(SurfelsOf(saved, system.GetMapper().Map()),
                                    Backend::kCpu,
                                    system.Sensor(),
                                    SlamConfig().mapper.engine,
                                    pool)
                          .value();
  Means means;
  for (const HeldOut& scan : system.HeldOuts()) {
    const HeldOutErrors errors =
        MeasureHeldOut(scan.range_m, engine->Render(system.PoseOf(scan.scan)).range_m);
    means.error_m += errors.mean_abs_m / static_cast<double>(system.HeldOuts().size());
    means.median_error_m += errors.median_abs_m / static_cast<double>(system.HeldOuts().size());
    means.coverage += errors.coverage / static_cast<double>(system.HeldOuts().size());
  }
  return means;
}

TEST(MapPrecision, ACompactMapShowsHeldOutScansAsWellAsTheMapItself) {
  const auto system = WalkThroughCourtyard();
  ASSERT_FALSE(system->HeldOuts().empty());
  const SavedMap map = FlattenMap(std::as_const(*system).GetMapper().Map());
  const std::string bytes = PackCompactMap(map);
  const double bytes_each = static_cast<double>(bytes.size()) / static_cast<double>(map.Size());
  const SavedMap read = ParseCompactMap(bytes, "").value();
  ASSERT_EQ(read.Size(), map.Size());
  ThreadPool pool(2);
  const Means whole = HeldOutMeans(map, *system, pool);
  const Means compact = HeldOutMeans(read, *system, pool);
  std::printf(
      "%zu Gaussians of %.2f bytes: mean error %.5f m, compact %.5f m; median %.6f m, %.6f m; "
      "coverage %.6f, %.6f\n",
      map.Size(),
      bytes_each,
      whole.error_m,
      compact.error_m,
      whole.median_error_m,
      compact.median_error_m,
      whole.coverage,
      compact.coverage);
  EXPECT_LT(bytes_each, 16.0);
  EXPECT_GT(whole.coverage, 0.5);  // there is something to compare
  EXPECT_NEAR(compact.error_m, whole.error_m, 1e-3 * whole.error_m);
  EXPECT_NEAR(compact.median_error_m, whole.median_error_m, 2e-3 * whole.median_error_m);
  EXPECT_NEAR(compact.coverage, whole.coverage, 1e-3);
}

}  // namespace
}  // namespace covsplat::test
