// What one 64 x 1024 scan of a handheld sensor costs: preparation and registration to a map.
#include "tests/support/walk.hpp"
#include <benchmark/benchmark.h>

namespace covsplat::test {
namespace {

void BM_Preprocess(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const Scan scan = WalkScan(SimulatedSensor());
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
  const Scan scan = WalkScan(SimulatedSensor());
  const MotionPrediction prediction = WalkPrediction();
  const SourceCloud source =
      Preprocess(scan, TimeScan(scan, DeskewConfig{}), prediction.motion, Fine(), pool);
  const RegistrationTarget target(RoomSurfels(SimulatedSensor(), pool), Eigen::Vector3d::Zero(), 1);
  AlignResult result;
  for (auto _ : state) result = Align(source, target, prediction, GicpConfig{}, pool);
  state.counters["surfels"] = static_cast<double>(target.Size());
  state.counters["points"] = static_cast<double>(source.Size());
  state.counters["iterations"] = result.iterations;
  state.counters["error_mm"] =
      1e3 * TranslationError(result.motion.T_map_sensor, HandheldWalk(kWalkStamp));
}
BENCHMARK(BM_Align)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_BuildTarget(benchmark::State& state) {
  ThreadPool pool(2);
  const std::vector<TargetSurfel> surfels = RoomSurfels(SimulatedSensor(), pool);
  for (auto _ : state) {
    benchmark::DoNotOptimize(RegistrationTarget(surfels, Eigen::Vector3d::Zero(), 1).Size());
  }
  state.counters["surfels"] = static_cast<double>(surfels.size());
}
BENCHMARK(BM_BuildTarget)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace covsplat::test
