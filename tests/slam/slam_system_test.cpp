#include "covsplat/slam/slam_system.hpp"

#include <cstring>
#include <memory>
#include <vector>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/eval/trajectory_error.hpp"

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.015;
constexpr int kLong = kSanitized ? 8 : 50;
constexpr int kShort = kSanitized ? 4 : 12;
// Ranges have 1.5 cm of noise and the walk sways: a sane system stays well below 2 cm.
constexpr double kSaneAteM = 0.02;

double StampOf(int k) { return kScanPeriod * k; }

std::vector<Scan> Walk(int scans,
                       const RayScene& scene = Room(),
                       const Motion& motion = HandheldWalk) {
  std::vector<Scan> all;
  for (int k = 0; k < scans; ++k) {
    all.push_back(Simulate(
        scene, ReducedSensor(), motion, StampOf(k), kNoise, static_cast<std::uint64_t>(k)));
    all.back().index = k;
  }
  return all;
}

Trajectory Truth(int scans) {
  Trajectory truth;
  for (int k = -1; k <= 20 * scans; ++k) {
    const double stamp = 0.05 * k;
    truth.push_back({stamp, HandheldWalk(stamp)});
  }
  return truth;
}

SlamConfig Config(Schedule schedule, int threads = 2) {
  SlamConfig config;
  config.system.schedule = schedule;
  config.system.threads = threads;
  config.system.held_out_interval = 7;
  if (kSanitized) {
    config.mapper.schedule = {
        .steps_new = 4, .steps_near = 2, .steps_old = 2, .steps_per_visit = 2, .final_steps = 0};
  }
  return config;
}

std::unique_ptr<SlamSystem> Create(const SlamConfig& config) {
  return std::move(SlamSystem::Create(config, ReducedSensor()).value());
}

struct SlamRun {
  std::unique_ptr<SlamSystem> system;
  std::vector<ScanRecord> records;

  Trajectory Poses() const {
    Trajectory poses;
    for (const ScanRecord& r : records) poses.push_back({r.stamp_s, r.T_map_sensor});
    return poses;
  }
};

SlamRun RunSlam(const SlamConfig& config, const std::vector<Scan>& scans) {
  SlamRun run{Create(config), {}};
  for (const Scan& scan : scans) {
    if (std::optional<ScanRecord> record = run.system->Process(scan))
      run.records.push_back(*record);
  }
  run.system->Finish();
  return run;
}

double Ate(const SlamRun& run) {
  return EvaluateTrajectory(run.Poses(), Truth(static_cast<int>(run.records.size())))
      .ate_translation_m.rmse;
}

/// Mean over the scans that were kept out of the map.
double HeldOutError(const SlamRun& run) {
  double sum = 0.0;
  for (const HeldOut& held_out : run.system->HeldOuts()) {
    const RenderOutput render = run.system->GetMapper().Render(run.system->PoseOf(held_out.scan));
    sum += MeanRangeError(render.range_m, held_out.range_m);
  }
  return sum / static_cast<double>(run.system->HeldOuts().size());
}

/// All numbers of a map, padding left out.
std::vector<float> Parameters(const SlamRun& run) {
  std::vector<float> all;
  const SplatEngine& engine = run.system->GetMapper().Map().Engine();
  for (const AnchorRange& range : engine.Ranges()) {
    for (int p = 0; p < kParameterCount; ++p) {
      const float* column = engine.Gaussians().Column(p);
      all.insert(all.end(), column + range.begin, column + range.end);
    }
  }
  return all;
}

std::vector<double> Numbers(const SlamRun& run) {
  std::vector<double> all;
  for (const ScanRecord& r : run.records) {
    const Eigen::Vector4d q = r.T_map_sensor.Rotation().coeffs();
    const Eigen::Vector3d t = r.T_map_sensor.Translation();
    all.insert(all.end(), q.begin(), q.end());
    all.insert(all.end(), t.begin(), t.end());
  }
  return all;
}

template <class T>
bool SameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

void ExpectTracked(const SlamRun& run) {
  ASSERT_FALSE(run.records.empty());
  EXPECT_EQ(run.records[0].state, TrackState::kInitializing);
  for (std::size_t k = 1; k < run.records.size(); ++k) {
    EXPECT_EQ(run.records[k].state, TrackState::kTracking) << "scan " << k;
  }
}

TEST(SlamSystem, KeepsTheWayThroughARoomInLockstep) {
  const SlamRun run = RunSlam(Config(Schedule::kLockstep), Walk(kLong));
  ExpectTracked(run);
  EXPECT_LT(Ate(run), kSaneAteM);
  EXPECT_GT(run.system->GetMapper().Map().Size(), 1000u);
  EXPECT_EQ(static_cast<int>(run.system->KeyframeScans().size()),
            run.system->GetMapper().Map().Keyframes());
  EXPECT_EQ(run.system->KeyframeScans().front(), 0);
}

TEST(SlamSystem, KeepsTheWayThroughARoomInTwoThreads) {
  const SlamRun run = RunSlam(Config(Schedule::kThreaded), Walk(kLong));
  ExpectTracked(run);
  EXPECT_LT(Ate(run), kSaneAteM);
  EXPECT_EQ(static_cast<int>(run.system->KeyframeScans().size()),
            run.system->GetMapper().Map().Keyframes());
}

TEST(SlamSystem, GivesTheSameBytesInLockstepForAnyNumberOfThreads) {
  const std::vector<Scan> scans = Walk(kShort);
  const SlamRun one = RunSlam(Config(Schedule::kLockstep, 1), scans);
  ASSERT_GT(one.system->GetMapper().Steps(), 0);
  for (const int threads : {2, 5}) {
    const SlamRun many = RunSlam(Config(Schedule::kLockstep, threads), scans);
    EXPECT_TRUE(SameBytes(Numbers(one), Numbers(many))) << threads << " threads: poses differ";
    EXPECT_TRUE(SameBytes(Parameters(one), Parameters(many))) << threads << " threads: maps differ";
  }
}

TEST(SlamSystem, RefinesItsMapUnlessToldNotTo) {
  if (kSanitized) GTEST_SKIP() << "too few optimiser steps under sanitizers to see a difference";
  const std::vector<Scan> scans = Walk(kLong);
  const SlamRun refined = RunSlam(Config(Schedule::kLockstep), scans);
  SlamConfig config = Config(Schedule::kLockstep);
  config.mapper.feedback.mode = FeedbackMode::kFrozen;
  const SlamRun frozen = RunSlam(config, scans);
  ExpectTracked(frozen);
  EXPECT_EQ(frozen.system->GetMapper().Steps(), 0);
  EXPECT_LT(Ate(frozen), kSaneAteM) << "tracking works on Gaussians as they were spawned as well";
  ASSERT_FALSE(refined.system->HeldOuts().empty());
  ASSERT_FALSE(frozen.system->HeldOuts().empty());
  EXPECT_LT(HeldOutError(refined), HeldOutError(frozen));
}

TEST(SlamSystem, HoldsOutOnlyScansThatAreNotInTheMap) {
  SlamConfig config = Config(Schedule::kLockstep);
  config.system.held_out_interval = 2;
  const SlamRun run = RunSlam(config, Walk(kShort));
  EXPECT_FALSE(run.system->HeldOuts().empty());
  std::int64_t last = 0;
  for (const HeldOut& held_out : run.system->HeldOuts()) {
    EXPECT_GE(held_out.scan, last + 2);
    last = held_out.scan;
    for (const std::int64_t keyframe : run.system->KeyframeScans()) {
      EXPECT_NE(held_out.scan, keyframe);
    }
  }
  config.system.held_out_interval = 0;
  EXPECT_TRUE(RunSlam(config, Walk(kShort)).system->HeldOuts().empty());
}

/// The share of the keyframes that were in the target of the next scan.
double ShareWaitedFor(double wait_support) {
  SlamConfig config = Config(Schedule::kThreaded);
  config.tracker.keyframe.max_scans = 3;
  config.tracker.keyframe.wait_support = wait_support;
  config.mapper.schedule.steps_new = kSanitized ? 20 : 200;  // longer than three scans take
  const SlamRun run = RunSlam(config, Walk(12));
  int keyframes = 0;
  int waited = 0;
  for (std::size_t k = 3; k + 1 < run.records.size(); ++k) {
    if (!run.records[k].is_keyframe || run.records[k].support >= 1.0) continue;
    ++keyframes;
    waited += run.records[k + 1].target_surfels != run.records[k].target_surfels;
  }
  EXPECT_GT(keyframes, 0);
  return static_cast<double>(waited) / std::max(1, keyframes);
}

TEST(SlamSystem, WaitsForKeyframesWhenScansLoseTheirSupport) {
  EXPECT_EQ(ShareWaitedFor(1.0), 1.0);
  EXPECT_LT(ShareWaitedFor(0.0), 0.5);
}

class BothSchedules : public ::testing::TestWithParam<Schedule> {};

TEST_P(BothSchedules, FinishTwiceIsFinishOnce) {
  SlamConfig config = Config(GetParam());
  config.mapper.schedule.final_steps = 6;
  SlamRun run = RunSlam(config, Walk(3));
  const std::int64_t steps = run.system->GetMapper().Steps();
  const std::vector<float> map = Parameters(run);
  run.system->Finish();
  EXPECT_EQ(run.system->GetMapper().Steps(), steps);
  EXPECT_TRUE(SameBytes(Parameters(run), map));
}

TEST_P(BothSchedules, MapARecordingOfOneScan) {
  const SlamRun run = RunSlam(Config(GetParam()), Walk(1));
  ASSERT_EQ(run.records.size(), 1u);
  EXPECT_EQ(run.system->GetMapper().Map().Keyframes(), 1);
  EXPECT_GT(run.system->GetMapper().Map().Size(), 1000u);
  EXPECT_EQ(run.system->KeyframeScans(), std::vector<std::int64_t>{0});
}

TEST_P(BothSchedules, MapARecordingWithoutScans) {
  const SlamRun run = RunSlam(Config(GetParam()), {});
  EXPECT_EQ(run.system->GetMapper().Map().Size(), 0u);
}

TEST_P(BothSchedules, MapARecordingOfEmptyScans) {
  std::vector<Scan> scans(3);
  for (int k = 0; k < 3; ++k) scans[static_cast<std::size_t>(k)].stamp_s = StampOf(k);
  const SlamRun run = RunSlam(Config(GetParam()), scans);
  EXPECT_EQ(run.records.size(), 3u);
  EXPECT_EQ(run.system->GetMapper().Map().Keyframes(), 0);
}

TEST_P(BothSchedules, MayBeDestroyedWithoutFinish) {
  Create(Config(GetParam()));
  for (const int scans : {1, 3}) {
    const std::unique_ptr<SlamSystem> system = Create(Config(GetParam()));
    for (const Scan& scan : Walk(scans)) EXPECT_TRUE(system->Process(scan));
  }
}

TEST_P(BothSchedules, MapWithGivenPosesAndSkipScansWithout) {
  const std::vector<Scan> scans = Walk(6);
  Trajectory poses;
  for (int i = 0; i <= 36; ++i) {  // 0.06 s to 0.42 s: scans 1 and 5 are not covered to their ends
    const double stamp = 0.06 + 0.01 * i;
    poses.push_back({stamp, HandheldWalk(stamp)});
  }
  const std::unique_ptr<SlamSystem> system = Create(Config(GetParam()));
  system->UsePoses(poses, GivenPoses::kExact);
  std::vector<int> mapped;
  for (int k = 0; k < 6; ++k) {
    const std::optional<ScanRecord> record = system->Process(scans[static_cast<std::size_t>(k)]);
    if (!record) continue;
    mapped.push_back(k);
    EXPECT_LT(TranslationError(record->T_map_sensor, HandheldWalk(StampOf(k))), 1e-4);
  }
  system->Finish();
  EXPECT_EQ(mapped, (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(system->KeyframeScans().front(), 1);
  EXPECT_GT(system->GetMapper().Map().Size(), 1000u);
}

INSTANTIATE_TEST_SUITE_P(SlamSystem,
                         BothSchedules,
                         ::testing::Values(Schedule::kLockstep, Schedule::kThreaded),
                         [](const auto& instance) {
                           return instance.param == Schedule::kLockstep ? "Lockstep" : "Threaded";
                         });

TEST(SlamSystem, ReportsThatACorridorHasNoEnd) {
  const auto walk = [](double t) { return MakePose(0, 0, 0, 0.5 * t, 0, 0); };
  const SlamRun corridor = RunSlam(Config(Schedule::kLockstep), Walk(kShort, Corridor(), walk));
  for (std::size_t k = 1; k < corridor.records.size(); ++k) {
    EXPECT_GE(corridor.records[k].degenerate_directions, 1) << "scan " << k;
  }
  const SlamRun room = RunSlam(Config(Schedule::kLockstep), Walk(kShort));
  for (const ScanRecord& record : room.records) EXPECT_EQ(record.degenerate_directions, 0);
}

TEST(SlamSystem, CountsWhatItDoes) {
  SlamConfig config = Config(Schedule::kLockstep);
  config.mapper.manage.interval = 1;  // nothing is left to do when the recording has ended
  const SlamRun run = RunSlam(config, Walk(kShort));
  std::int64_t steps = 0;
  for (const ScanRecord& record : run.records) {
    EXPECT_GE(record.mapper_steps, steps);
    steps = record.mapper_steps;
    EXPECT_TRUE(record.has_time);
    EXPECT_EQ(record.not_finite, 0u);
    EXPECT_GT(record.source_points, 0u);
  }
  EXPECT_EQ(steps, run.system->GetMapper().Steps());
  EXPECT_EQ(run.records.back().gaussians, run.system->GetMapper().Map().Size());
}

}  // namespace
}  // namespace covsplat::test
