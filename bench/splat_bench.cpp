// Rendering and optimising on each backend against the number of Gaussians, on the image of a 64 x
// 1024 sensor in the middle of a hall whose surfaces are covered evenly, so that all are in view;
// and, where the recording is at hand, optimising a street.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "bench/recorded_street.hpp"
#include <benchmark/benchmark.h>

#include "covsplat/core/rng.hpp"
#include "covsplat/splat/compact_view.hpp"
#include "covsplat/splat/cpu/rasterizer.hpp"
#include "covsplat/splat/cuda/device_info.hpp"
#include "covsplat/splat/engine.hpp"
#include "covsplat/splat/surface_normals.hpp"

namespace covsplat {
namespace {

constexpr int kStepsPerView = 10;  // as a run makes them, which is once per binning
constexpr int kAnchors = 4;
const Eigen::Vector3d kHalfHall(15.0, 10.0, 3.0);

const SensorModel& Sensor() {
  static const SensorModel sensor = UniformSensorModel(64, 1024, -0.39, 0.39, 0.5, 60.0);
  return sensor;
}

SE3 AnchorPose(int anchor) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(2.0 * anchor - 3.0, 0.5 * anchor, 0.0)};
}

/// What the sensor measures in the hall from an anchor.
RangeMeasurement Measure(int anchor) {
  const Eigen::Vector3d from = AnchorPose(anchor).Translation();
  const int rows = Sensor().Rows();
  const int columns = Sensor().Columns();
  RangeMeasurement m{Image<float>(rows, columns, 0.0f),
                     Image<Eigen::Vector3f>(rows, columns, Eigen::Vector3f::Zero())};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector3d ray = Sensor().RayOf(row, column).cast<double>();
      double nearest = 1e9;
      for (int axis = 0; axis < 3; ++axis) {
        const double side = ray[axis] < 0.0 ? -1.0 : 1.0;
        const double t = (side * kHalfHall[axis] - from[axis]) / (ray[axis] + side * 1e-9);
        if (t >= nearest) continue;
        nearest = t;
        m.normal(row, column) = static_cast<float>(-side) * Eigen::Vector3f::Unit(axis);
      }
      m.range_m(row, column) = static_cast<float>(nearest);
    }
  }
  return m;
}

/// Surfels spread evenly over the hall's six sides, a little off, in the map's frame.
GaussianColumns<float> Cover(std::size_t count) {
  const Eigen::Vector3d side = 2.0 * kHalfHall;
  const Eigen::Vector3d area(side.y() * side.z(), side.x() * side.z(), side.x() * side.y());
  const double scale = 0.6 * std::sqrt(2.0 * area.sum() / static_cast<double>(count));
  const auto log_scale = Eigen::Vector2f::Constant(static_cast<float>(std::log(scale)));
  GaussianColumns<float> table;
  table.Resize(count);
  Rng rng(1);
  for (std::size_t i = 0; i < count; ++i) {
    const double pick = rng.Uniform() * area.sum();
    const int axis = pick < area.x() ? 0 : pick < area.x() + area.y() ? 1 : 2;
    const double sign = rng.Uniform() < 0.5 ? -1.0 : 1.0;
    Eigen::Vector3d mean;
    for (int k = 0; k < 3; ++k) mean[k] = kHalfHall[k] * rng.Uniform(-1.0, 1.0);
    mean[axis] = sign * kHalfHall[axis] + 0.02 * rng.Normal();
    const Eigen::Vector3d tilt(rng.Normal(), rng.Normal(), rng.Normal());
    const Eigen::Vector3d normal = (0.1 * tilt - sign * Eigen::Vector3d::Unit(axis)).normalized();
    const auto q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    WriteGaussian(table, i, mean.cast<float>(), q.cast<float>(), log_scale, 1.5f);
  }
  return table;
}

std::unique_ptr<SplatEngine> MakeHall(Backend backend, std::size_t count, ThreadPool& pool) {
  auto engine = MakeSplatEngine(backend, Sensor(), {}, pool).value();
  const int map = engine->AddAnchor(SE3());
  engine->Append(map, Cover(count));
  for (int anchor = 0; anchor < kAnchors; ++anchor) {
    engine->SetView(engine->AddAnchor(AnchorPose(anchor)), Measure(anchor));
  }
  return engine;
}

void BM_Render(benchmark::State& state, Backend backend) {
  ThreadPool pool(0);
  const auto engine = MakeHall(backend, static_cast<std::size_t>(state.range(0)), pool);
  int anchor = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(engine->Render(AnchorPose(anchor++ % kAnchors)).alpha.Size());
  }
}

/// Forward, loss, backward and Adam, with all that comes between.
void BM_Step(benchmark::State& state, Backend backend) {
  ThreadPool pool(0);
  const auto engine = MakeHall(backend, static_cast<std::size_t>(state.range(0)), pool);
  int visit = 0;
  StepReport report;
  for (auto _ : state) {
    const int anchor = 1 + visit++ % kAnchors;
    for (int i = 0; i < kStepsPerView; ++i) report = engine->Step(anchor, true);
  }
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

/// The stages of such a step on the CPU: milliseconds per view for what is done once for each, per
/// step for the rest; the least of all iterations.
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
