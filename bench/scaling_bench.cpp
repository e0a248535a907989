// How time grows with the work: beams of the sensor, Gaussians in view, and threads.
#include <algorithm>
#include <thread>

#include "bench/hall.hpp"
#include "tests/support/walk.hpp"
#include <benchmark/benchmark.h>

namespace covsplat::test {
namespace {

constexpr std::int64_t kBeams = 64;
constexpr std::int64_t kGaussians = 100'000;

/// A step of the optimiser on an image of 1024 columns, with all that comes between.
void BM_StepByWork(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const SensorModel sensor = HallSensor(static_cast<int>(state.range(1)));
  const auto engine =
      MakeHall(Backend::kCpu, sensor, static_cast<std::size_t>(state.range(2)), pool);
  int visit = 0;
  for (auto _ : state) VisitHall(*engine, visit++);
  const double steps = static_cast<double>(kStepsPerView) * visit;
  state.counters["steps/s"] = benchmark::Counter(steps, benchmark::Counter::kIsRate);
}

/// Preparation of a scan of 1024 columns and its registration to the surfels of six others.
void BM_TrackByWork(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const SensorModel sensor = HallSensor(static_cast<int>(state.range(1)));
  const RegistrationTarget target(RoomSurfels(sensor, pool), Eigen::Vector3d::Zero(), 1);
  const Scan scan = WalkScan(sensor);
  const ScanTiming timing = TimeScan(scan, DeskewConfig{});
  const MotionPrediction prediction = WalkPrediction();
  int iterations = 0;
  for (auto _ : state) {
    const SourceCloud source = Preprocess(scan, timing, prediction.motion, Fine(), pool);
    iterations = Align(source, target, prediction, GicpConfig{}, pool).iterations;
  }
  state.counters["iterations"] = iterations;
  state.counters["points"] = static_cast<double>(scan.points.size());
}

/// One curve after the other: the rest stays at the middle of its own curve.
void Register() {
  const auto processors =
      static_cast<std::int64_t>(std::max(1u, std::thread::hardware_concurrency()));
  const std::int64_t all = std::min<std::int64_t>(processors, 16);
  auto* step = benchmark::RegisterBenchmark("BM_StepByWork", BM_StepByWork);
  step->ArgNames({"threads", "beams", "gaussians"});
  auto* track = benchmark::RegisterBenchmark("BM_TrackByWork", BM_TrackByWork);
  track->ArgNames({"threads", "beams"});
  for (const std::int64_t beams : {16, 32, 64, 128}) {
    step->Args({all, beams, kGaussians});
    track->Args({all, beams});
  }
  for (const std::int64_t gaussians : {10'000, 30'000, 300'000, 1'000'000, 2'000'000}) {
    step->Args({all, kBeams, gaussians});
  }
  for (std::int64_t threads = 1; threads < all; threads *= 2) {
    step->Args({threads, kBeams, kGaussians});
    track->Args({threads, kBeams});
  }
  for (auto* bench : {step, track}) bench->UseRealTime()->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace covsplat::test

int main(int argc, char** argv) {
  covsplat::test::Register();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
