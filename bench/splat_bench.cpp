// Rendering and optimising on each backend against the number of Gaussians, on the image of a 64 x
// 1024 sensor in the middle of a hall whose surfaces are covered evenly, so that all are in view;
// and, where the recording is at hand, optimising a street.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <string>

#include "bench/hall.hpp"
#include "bench/machine_peak.hpp"
#include "bench/recorded_street.hpp"
#include <benchmark/benchmark.h>

#include "covsplat/splat/compact_view.hpp"
#include "covsplat/splat/cpu/rasterizer.hpp"
#include "covsplat/splat/cuda/device_info.hpp"
#include "covsplat/splat/engine.hpp"
#include "covsplat/splat/surface_normals.hpp"

namespace covsplat {
namespace {

constexpr int kRows = 64;

void BM_Render(benchmark::State& state, Backend backend) {
  ThreadPool pool(0);
  const auto gaussians = static_cast<std::size_t>(state.range(0));
  const auto engine = MakeHall(backend, HallSensor(kRows), gaussians, pool);
  int view = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(engine->Render(HallPose(view++)).alpha.Size());
  }
}

/// Forward, loss, backward and Adam, with all that comes between.
void BM_Step(benchmark::State& state, Backend backend) {
  ThreadPool pool(0);
  const auto gaussians = static_cast<std::size_t>(state.range(0));
  const auto engine = MakeHall(backend, HallSensor(kRows), gaussians, pool);
  int visit = 0;
  StepReport report;
  for (auto _ : state) report = VisitHall(*engine, visit++);
  benchmark::DoNotOptimize(engine->Gaussians().Size());  // all work is done
  const double steps = static_cast<double>(kStepsPerView) * visit;
  state.counters["steps/s"] = benchmark::Counter(steps, benchmark::Counter::kIsRate);
  state.counters["pairs"] = static_cast<double>(report.pairs);
  state.counters["device_MB"] = 1e-6 * static_cast<double>(cuda::DeviceBytes());
}

void BM_DeviceCopy(benchmark::State& state) {
  for (auto _ : state) state.counters["B/s"] = cuda::MeasureCopyBandwidth();
}

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

MomentColumns<float> FreshMoments(std::size_t size) {
  MomentColumns<float> moments;
  moments.Resize(size);
  for (int c = 0; c < kMomentCount; ++c) {
    std::fill_n(moments.Column(c), size + kBlockSize, FreshMoment(c));
  }
  return moments;
}

const SE3 kStreetPose{Eigen::Quaterniond(0.9, 0.1, -0.2, 0.4), Eigen::Vector3d(30.0, -20.0, 1.0)};

/// One view of the street, from the same surfels every time: the time per step.
void BM_StreetStep(benchmark::State& state, const RecordedStreet& street, Backend backend) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const auto surfels =
      street.Surfels(static_cast<std::size_t>(state.range(1)), static_cast<double>(state.range(2)));
  auto engine = MakeSplatEngine(backend, street.Sensor(), {}, pool).value();
  const int anchor = engine->AddAnchor(kStreetPose);
  engine->SetView(anchor, street.Measurement());
  StepReport report;
  for (auto _ : state) {
    engine->Keep(std::vector<std::uint8_t>(engine->Gaussians().Size(), 0));
    engine->Append(anchor, surfels);
    const auto begin = Clock::now();
    for (int i = 0; i < kStepsPerView; ++i) report = engine->Step(anchor, true);
    state.SetIterationTime(SecondsSince(begin) / kStepsPerView);
  }
  const auto pairs = static_cast<double>(report.pairs);
  state.counters["pairs"] = pairs;
  state.counters["pairs/surfel"] = pairs / static_cast<double>(surfels.Size());
}

/// Arithmetic and memory traffic of a stage, for its roofline. Counted in the source: a
/// multiply-add is two operations, a reciprocal or an exponential what it is made of; what is
/// written counts once.
struct Work {
  double flops;
  double bytes;
};

Work ProjectionOf(std::size_t gaussians) {
  constexpr double kFlops = 240.0;
  constexpr double kBytes = kParameterCount * sizeof(float) + sizeof(SurfelRecord<float>);
  return {kFlops * static_cast<double>(gaussians), kBytes * static_cast<double>(gaussians)};
}

/// Forward, loss and backward.
Work TilesOf(const Rasterizer<float>& rasterizer) {
  constexpr double kFlopsPerPixelAndPair = 66.0 + 63.0;  // there and back
  constexpr double kBytesPerPair = sizeof(TilePair) + sizeof(SurfelRecord<float>);
  constexpr double kBytesPerSlot = 16 * sizeof(float);
  constexpr double kBytesPerPixel = 7 * sizeof(float);  // range, two normals
  const auto pairs = static_cast<double>(rasterizer.ListedPairs());
  const auto slots = static_cast<double>(rasterizer.Slots());
  const auto pixels = static_cast<double>(kTilePixels * rasterizer.View().Tiles());
  return {kFlopsPerPixelAndPair * kTilePixels * pairs,
          kBytesPerPair * pairs + kBytesPerSlot * slots + kBytesPerPixel * pixels};
}

Work OptimizationOf(std::size_t gaussians, std::size_t slots) {
  constexpr double kFlops = 270.0;
  constexpr double kFlopsPerSlot = 16.0;
  constexpr double kSlotBytes = 16 * sizeof(float);
  constexpr double kBytes = sizeof(SurfelRecord<float>) +
                            2.0 * (int{kParameterCount} + int{kMomentCount}) * sizeof(float);
  const auto n = static_cast<double>(gaussians);
  const auto s = static_cast<double>(slots);
  return {kFlops * n + kFlopsPerSlot * s, kBytes * n + kSlotBytes * s};
}

/// Adds what a stage takes at the roof, ms.
void CountRoof(benchmark::State& state, const char* stage, const MachinePeak& peak, Work work) {
  state.counters[std::string(stage) + "_roof"] =
      1e3 * RooflineSeconds(peak, work.flops, work.bytes);
}

/// The stages of such a step on the CPU: milliseconds per view for what is done once for each, per
/// step for the rest; the least of all iterations. Beside those of a step what the machine's
/// roofline leaves of them.
void BM_StreetStages(benchmark::State& state, const RecordedStreet& street) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  const auto surfels =
      street.Surfels(static_cast<std::size_t>(state.range(1)), static_cast<double>(state.range(2)));
  const EngineConfig config;
  Rasterizer<float> rasterizer(street.Sensor(), config.raster, pool);
  const CompactView view(rasterizer.View(), street.Sensor().MaxRange(), street.Measurement());
  TileTargets<float> targets;
  const auto time = [&](const char* stage, auto&& run) {
    const auto begin = Clock::now();
    run();
    const double milliseconds = 1e3 * SecondsSince(begin);
    const auto known = state.counters.find(stage);
    if (known == state.counters.end() || known->second > milliseconds) {
      state.counters[stage] = milliseconds;
    }
  };
  for (auto _ : state) {
    auto gaussians = surfels;
    MomentColumns<float> moments = FreshMoments(gaussians.Size());
    const std::vector<AnchorRange> ranges{{0, 0, gaussians.Size()}};
    const std::vector<SE3> poses{kStreetPose};
    time("expand", [&] { view.Expand(targets); });
    time("look", [&] { rasterizer.LookFrom(kStreetPose, gaussians, ranges, poses); });
    time("render", [&] { rasterizer.Render(); });
    time("normals", [&] {
      FindSurfaceNormals(
          rasterizer.View(), rasterizer.Images(), config.loss.min_alpha, pool, targets);
    });
    for (int i = 0; i < kStepsPerView; ++i) {
      if (i > 0) time("project", [&] { rasterizer.Refresh(gaussians); });
      time("tiles", [&] { rasterizer.StepLoss(targets, config.loss, nullptr); });
      time("optimize",
           [&] { rasterizer.Optimize(gaussians, moments, config.loss, config.optimizer); });
    }
  }
  const MachinePeak peak = MeasurePeak(pool);
  state.counters["peak_GFLOP/s"] = 1e-9 * peak.flops_per_s;
  state.counters["peak_GB/s"] = 1e-9 * peak.bytes_per_s;
  state.counters["pairs"] = static_cast<double>(rasterizer.ListedPairs());
  CountRoof(state, "project", peak, ProjectionOf(surfels.Size()));
  CountRoof(state, "tiles", peak, TilesOf(rasterizer));
  CountRoof(state, "optimize", peak, OptimizationOf(surfels.Size(), rasterizer.Slots()));
}

void RegisterStreet(const RecordedStreet& street) {
  const auto add = [](benchmark::internal::Benchmark* bench) {
    bench->ArgNames({"threads", "surfels", "footprint"})->Unit(benchmark::kMillisecond);
    for (const std::int64_t threads : {1, 2}) {
      for (const std::int64_t footprint : {1, 2, 3}) bench->Args({threads, 100000, footprint});
      for (const std::int64_t surfels : {50000, 200000}) bench->Args({threads, surfels, 2});
    }
    return bench;
  };
  add(benchmark::RegisterBenchmark("BM_StreetStep/cpu", [&](benchmark::State& state) {
    BM_StreetStep(state, street, Backend::kCpu);
  }))->UseManualTime();
  add(benchmark::RegisterBenchmark("BM_StreetStages/cpu", [&](benchmark::State& state) {
    BM_StreetStages(state, street);
  }))->UseRealTime();
}

void Register(const std::string& name, Backend backend) {
  for (auto* bench :
       {benchmark::RegisterBenchmark(("BM_Render/" + name).c_str(), BM_Render, backend),
        benchmark::RegisterBenchmark(("BM_Step/" + name).c_str(), BM_Step, backend)}) {
    bench->Arg(30000)->Arg(100000)->Arg(300000)->UseRealTime()->Unit(benchmark::kMillisecond);
  }
}

}  // namespace
}  // namespace covsplat

int main(int argc, char** argv) {
  using namespace covsplat;
  Register("cpu", Backend::kCpu);
  if (const Result<std::string> device = cuda::FindDevice()) {
    benchmark::AddCustomContext("device", *device);
    Register("cuda", Backend::kCuda);
    benchmark::RegisterBenchmark("BM_DeviceCopy", BM_DeviceCopy)->Iterations(1);
  }
  const std::optional<RecordedStreet> street = RecordedStreet::Load();
  if (street) {
    RegisterStreet(*street);
  } else {
    std::fputs("no kitti_raw_0005: no street; set COVSPLAT_DATA\n", stderr);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
