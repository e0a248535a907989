#include "covsplat/splat/engine.hpp"

#include <cmath>
#include <cstring>

#include "tests/splat/scenes.hpp"
#include <gtest/gtest.h>

#include "covsplat/splat/cuda/device_info.hpp"

namespace covsplat {
namespace {

std::unique_ptr<SplatEngine> MakeEngine(ThreadPool& pool) {
  EngineConfig config;  // far from the truth: larger steps than a map needs that starts on surfaces
  config.optimizer.mean_step_m = 1e-3;
  config.optimizer.rotation_step_rad = 5e-3;
  config.loss.through_filter = true;  // many discs are no larger than a pixel
  return std::move(MakeSplatEngine(Backend::kCpu, RoomSensor(), config, pool).value());
}

double MeanRangeError(const RenderOutput& render, const RangeMeasurement& m) {
  double sum = 0.0;
  for (std::size_t i = 0; i < m.range_m.Size(); ++i) {
    sum += std::abs(render.range_m.Pixels()[i] - m.range_m.Pixels()[i]);
  }
  return sum / static_cast<double>(m.range_m.Size());
}

TEST(SplatEngine, OptimisingExplainsTheMeasurement) {
  ThreadPool pool(2);
  const auto engine = MakeEngine(pool);
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  const SE3 pose = SE3::Exp((Vector6d() << 0.1, 0.2, -0.4, 10.0, -5.0, 2.0).finished());
  const int anchor = engine->AddAnchor(pose);
  engine->Append(anchor, NoisyRoom(RoomSensor(), m));
  engine->SetView(anchor, m);
  const double before = MeanRangeError(engine->Render(pose), m);
  StepReport first;
  StepReport last;
  for (int i = 0; i < 200; ++i) {
    last = engine->Step(anchor, i > 50);
    if (i == 0) first = last;
  }
  EXPECT_LT(last.range_loss, 0.3 * first.range_loss);
  EXPECT_LT(last.opacity_loss, first.opacity_loss);
  EXPECT_LT(MeanRangeError(engine->Render(pose), m), 0.3 * before);
}

TEST(SplatEngine, GaussiansGrowNoFurtherThanAllowed) {
  ThreadPool pool(2);
  EngineConfig config;
  config.loss.opacity = 0.1;  // most grow, but not all
  config.optimizer.max_growth = 1.2;
  const auto engine = MakeSplatEngine(Backend::kCpu, RoomSensor(), config, pool).value();
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  const GaussianColumns<float> start = NoisyRoom(RoomSensor(), m);
  engine->AddAnchor(SE3());
  engine->Append(0, start);
  engine->SetView(0, m);
  for (int i = 0; i < 100; ++i) engine->Step(0, false);
  int at_the_limit = 0;
  int narrower = 0;
  for (const Parameter scale : {kLogScaleU, kLogScaleV}) {
    for (std::size_t i = 0; i < start.Size(); ++i) {
      const float growth = engine->Gaussians().Column(scale)[i] - start.Column(scale)[i];
      ASSERT_LT(growth, std::log(1.2) + 1e-5) << i;
      at_the_limit += growth > std::log(1.2) - 1e-5;
      narrower += growth < 0.0f;
    }
  }
  EXPECT_GT(at_the_limit, 10);
  EXPECT_GT(narrower, 10);
}

TEST(SplatEngine, SameBitsForAnyNumberOfThreads) {
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  const auto optimise = [&](int threads) {
    ThreadPool pool(threads);
    const auto engine = MakeEngine(pool);
    engine->AddAnchor(SE3());
    engine->Append(0, NoisyRoom(RoomSensor(), m));
    engine->SetView(0, m);
    for (int i = 0; i < 25; ++i) engine->Step(0, true);
    return engine->Gaussians();
  };
  const GaussianColumns<float> one = optimise(1);
  for (const int threads : {2, 5}) {
    const GaussianColumns<float> many = optimise(threads);
    for (int p = 0; p < kParameterCount; ++p) {
      EXPECT_EQ(std::memcmp(one.Column(p), many.Column(p), one.Size() * sizeof(float)), 0);
    }
  }
}

TEST(SplatEngine, ADroppedViewTakesNoMoreSteps) {
  ThreadPool pool(1);
  const auto engine = MakeEngine(pool);
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  engine->AddAnchor(SE3());
  engine->Append(0, NoisyRoom(RoomSensor(), m));
  engine->SetView(0, m);
  engine->Step(0, false);
  engine->DropView(0);
  EXPECT_DEATH(engine->Step(0, false), "");
  engine->SetView(0, m);
  EXPECT_GT(engine->Step(0, false).range_loss, 0.0);
}

TEST(SplatEngine, AMovedAnchorTakesItsGaussiansAlong) {
  ThreadPool pool(1);
  ExpectAMovedAnchorTakesItsGaussiansAlong(*MakeEngine(pool));
}

TEST(SplatEngine, KeepRemovesTheOthersAndNothingElse) {
  ThreadPool pool(1);
  const auto engine = MakeEngine(pool);
  engine->AddAnchor(SE3());
  engine->AddAnchor(SE3());
  engine->Append(0, RandomGaussians<float>(37, 0.0, 1));
  engine->Append(1, RandomGaussians<float>(50, 1.0, 2));
  const GaussianColumns<float> before = engine->Gaussians();
  std::vector<std::uint8_t> keep(before.Size(), 1);
  for (std::size_t i = 0; i < keep.size(); i += 3) keep[i] = 0;
  const std::vector<std::size_t> old_row = OldRows(engine->Keep(keep));
  std::size_t kept = 0;
  for (const AnchorRange& range : engine->Ranges()) {
    EXPECT_EQ(range.begin % kBlockSize, 0u);
    for (std::size_t i = range.begin; i < range.end; ++i, ++kept) {
      EXPECT_EQ(keep[old_row[i]], 1);
      for (int p = 0; p < kParameterCount; ++p) {
        EXPECT_EQ(engine->Gaussians().Column(p)[i], before.Column(p)[old_row[i]]);
      }
    }
  }
  EXPECT_EQ(kept, 87u - 30u);  // of 37 rows 13 go, of 50 rows (from row 48) 17
}

TEST(SplatEngine, CudaIsAClearErrorWithoutIt) {
  if (cuda::FindDevice()) GTEST_SKIP() << "there is a CUDA device";
  ThreadPool pool(1);
  const auto engine = MakeSplatEngine(Backend::kCuda, RoomSensor(), {}, pool);
  ASSERT_FALSE(engine.has_value());
  EXPECT_EQ(engine.error().code, ErrorCode::kUnavailable);
}

TEST(SplatEngine, AutoTakesTheCpuWithoutCuda) {
  if (cuda::FindDevice()) GTEST_SKIP() << "there is a CUDA device";
  ThreadPool pool(1);
  const auto engine = MakeSplatEngine(Backend::kAuto, RoomSensor(), {}, pool);
  ASSERT_TRUE(engine.has_value());
  EXPECT_EQ((*engine)->Device().substr(0, 3), "cpu");
}

}  // namespace
}  // namespace covsplat
