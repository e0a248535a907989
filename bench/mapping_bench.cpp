// What one keyframe of a 64 x 1024 sensor costs: becoming an image, being rendered and optimised in
// a map of the courtyard, and the target that follows.
#include "tests/support/mapping_fixtures.hpp"
#include <benchmark/benchmark.h>

#include "covsplat/mapping/mapper.hpp"
#include "covsplat/sim/simulation.hpp"

namespace covsplat::test {
namespace {

constexpr int kKeyframes = 12;
constexpr int kScansBetween = 25;
constexpr int kStepsEach = 20;

const Simulation& Courtyard() {
  static const Simulation simulation = Simulation::Create({}).value();
  return simulation;
}

TrackedScan TrackedAt(int scan, ThreadPool& pool) {
  const Scan still = Deskewed(Courtyard().MakeScan(scan, pool), Courtyard().SensorMotion());
  SourceCloud source = PreprocessStill(still, pool);
  TrackedScan tracked;
  tracked.scan = scan;
  tracked.T_odom_sensor = Courtyard().PoseOf(scan);
  tracked.points = still.points;
  tracked.surface = std::move(source.points);
  tracked.covariance = std::move(source.covariance);
  tracked.squared_distance.assign(tracked.surface.size(), 1e-4f);
  return tracked;
}

Keyframe KeyframeAt(int scan, ThreadPool& pool) {
  return MakeKeyframe(TrackedAt(scan, pool), Courtyard().Sensor(), kMaxSurfaceDistance, pool);
}

/// A map of the first keyframes of the walk, as optimised as it would be when they have passed.
std::unique_ptr<Mapper> MapOfTheCourtyard(ThreadPool& pool) {
  MapperConfig config;
  config.schedule.steps_new = kStepsEach;
  config.schedule.steps_near = 0;
  config.schedule.max_steps_per_view = 0;
  auto engine = MakeSplatEngine(Backend::kCpu, Courtyard().Sensor(), config.engine, pool).value();
  auto mapper = std::make_unique<Mapper>(std::move(engine), Courtyard().Sensor(), config, pool);
  for (int k = 0; k < kKeyframes; ++k) {
    mapper->Insert(KeyframeAt(k * kScansBetween, pool));
    mapper->OptimizeNewest();
  }
  return mapper;
}

void CountGaussians(benchmark::State& state, const Mapper& mapper) {
  state.counters["gaussians"] = static_cast<double>(mapper.Map().Size());
}

void BM_MakeKeyframe(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const TrackedScan tracked = TrackedAt(kScansBetween, pool);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        MakeKeyframe(tracked, Courtyard().Sensor(), kMaxSurfaceDistance, pool).point.Size());
  }
}
BENCHMARK(BM_MakeKeyframe)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_Render(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const auto mapper = MapOfTheCourtyard(pool);
  const SE3 pose = Courtyard().PoseOf(kScansBetween * (kKeyframes - 1) / 2);
  for (auto _ : state) benchmark::DoNotOptimize(mapper->Render(pose).alpha.Size());
  CountGaussians(state, *mapper);
}
BENCHMARK(BM_Render)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

/// Forward, loss, backward and Adam for one view. Optimises on, as a run would.
void BM_OptimizerStep(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const auto mapper = MapOfTheCourtyard(pool);
  const std::int64_t before = mapper->Steps();
  for (auto _ : state) mapper->OptimizeIdle();
  const double steps = static_cast<double>(mapper->Steps() - before);
  state.counters["steps/s"] = benchmark::Counter(steps, benchmark::Counter::kIsRate);
  state.counters["steps"] = steps / static_cast<double>(state.iterations());
  CountGaussians(state, *mapper);
}
BENCHMARK(BM_OptimizerStep)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

void BM_MakeTarget(benchmark::State& state) {
  ThreadPool pool(2);
  const auto mapper = MapOfTheCourtyard(pool);
  for (auto _ : state) benchmark::DoNotOptimize(mapper->MakeTarget(SE3())->Size());
  CountGaussians(state, *mapper);
}
BENCHMARK(BM_MakeTarget)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace covsplat::test
