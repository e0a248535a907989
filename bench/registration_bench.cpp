// What one 64 x 1024 scan of a handheld sensor costs: preparation and registration to a map.
#include "tests/support/registration_fixtures.hpp"
#include <benchmark/benchmark.h>

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.02;
constexpr double kStamp = 1.0;

Scan WalkScan() { return Simulate(Room(), SimulatedSensor(), HandheldWalk, kStamp, kNoise); }

MotionPrediction WalkPrediction() {
  const SE3 before = HandheldWalk(kStamp - kScanPeriod);
  MotionPrediction prediction;
  prediction.motion.twist = (before.Inverse() * HandheldWalk(kStamp)).Log();
  prediction.motion.T_map_sensor = HandheldWalk(kStamp) * MakePose(0.01, 0.01, 0.02, 0.05, 0, 0);
  prediction.horizon_s = 0.3;
  return prediction;
}

PreprocessConfig Fine() {
  PreprocessConfig config;
  config.downsample_voxel_m = 0.3;
  return config;
}

std::vector<TargetSurfel> RoomSurfels(ThreadPool& pool) {
  std::vector<TargetSurfel> surfels;
  for (int k = 0; k < 6; ++k) {
    const SE3 pose = HandheldWalk(3.0 * k);
    AppendSurfels(
        StillCloud(Room(), pose, kNoise, static_cast<std::uint64_t>(k), pool), pose, surfels);
  }
  return surfels;
}

void BM_Preprocess(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const Scan scan = WalkScan();
  const ScanTiming timing = TimeScan(scan, DeskewConfig{});
  const MotionPrediction prediction = WalkPrediction();
  std::size_t size = 0;
  for (auto _ : state) {
    size = Preprocess(scan, timing, prediction.motion, Fine(), pool).Size();
  }
  state.counters["points"] = static_cast<double>(size);
}
BENCHMARK(BM_Preprocess)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_Align(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const Scan scan = WalkScan();
  const MotionPrediction prediction = WalkPrediction();
  const SourceCloud source =
      Preprocess(scan, TimeScan(scan, DeskewConfig{}), prediction.motion, Fine(), pool);
  const RegistrationTarget target(RoomSurfels(pool), Eigen::Vector3d::Zero(), 1);
  AlignResult result;
  for (auto _ : state) result = Align(source, target, prediction, GicpConfig{}, pool);
  state.counters["surfels"] = static_cast<double>(target.Size());
  state.counters["points"] = static_cast<double>(source.Size());
  state.counters["iterations"] = result.iterations;
  state.counters["error_mm"] =
      1e3 * TranslationError(result.motion.T_map_sensor, HandheldWalk(kStamp));
}
BENCHMARK(BM_Align)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_BuildTarget(benchmark::State& state) {
  ThreadPool pool(2);
  const std::vector<TargetSurfel> surfels = RoomSurfels(pool);
  for (auto _ : state) {
    benchmark::DoNotOptimize(RegistrationTarget(surfels, Eigen::Vector3d::Zero(), 1).Size());
  }
  state.counters["surfels"] = static_cast<double>(surfels.size());
}
BENCHMARK(BM_BuildTarget)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace covsplat::test
