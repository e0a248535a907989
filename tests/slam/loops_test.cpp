// A lap that does not close: the sensor sees the world a little bent, so the way drifts.
#include <cstdio>
#include <numbers>
#include <span>

#include "tests/loops/block_city.hpp"
#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/slam/slam_system.hpp"

namespace covsplat::test {
namespace {

constexpr double kHalfM = 25.0;
constexpr double kCornerM = 8.0;
constexpr double kStraightM = 2.0 * (kHalfM - kCornerM);
constexpr double kArcM = 0.5 * std::numbers::pi * kCornerM;
constexpr double kLapM = 4.0 * (kStraightM + kArcM);
constexpr double kSpeedMps = 10.0;
constexpr double kBendPerM = 3e-4;
constexpr int kScans = kSanitized ? 20 : 225;

/// It sees a part of the block at a time.
SensorModel NearSensor() { return UniformSensorModel(32, 384, -0.4, 0.3, 0.5, 25.0); }

/// From rest.
double WayOf(double stamp_s) {
  const double gone_s = std::max(0.0, stamp_s);
  return kSpeedMps * (gone_s - 1.0 + std::exp(-gone_s));
}

/// Round the block with round corners.
SE3 Drive(double stamp_s) {
  const double way_m = WayOf(stamp_s) + 0.5 * kStraightM;
  const double side = std::floor(way_m / (kStraightM + kArcM));
  const double on_m = way_m - side * (kStraightM + kArcM);
  const double turn = std::max(0.0, on_m - kStraightM) / kCornerM;
  const Eigen::Vector3d begin(-0.5 * kStraightM + std::min(on_m, kStraightM), -kHalfM, 0.0);
  const Eigen::Vector3d round(kCornerM * std::sin(turn), kCornerM * (1.0 - std::cos(turn)), 0.0);
  const Eigen::AngleAxisd heading(0.5 * std::numbers::pi * side, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd turned(turn, Eigen::Vector3d::UnitZ());
  return {Eigen::Quaterniond(heading * turned), heading * (begin + round)};
}

const std::vector<Scan>& BentScans() {
  static const std::vector<Scan> scans = [] {
    const RayScene city = BlockCity();
    std::vector<Scan> all;
    for (int k = 0; k < kScans; ++k) {
      all.push_back(Simulate(
          city, NearSensor(), Drive, kScanPeriod * k, 0.01, static_cast<std::uint64_t>(k)));
      all.back().index = k;
      for (Eigen::Vector3f& p : all.back().points) {
        p.y() += 0.5f * static_cast<float>(kBendPerM) * p.x() * p.x();
      }
    }
    return all;
  }();
  return scans;
}

struct Lap {
  std::unique_ptr<SlamSystem> system;
  std::vector<ScanRecord> records;

  /// How far the second lap's begin is from the first one's, beside what it should be.
  double Gap() const {
    double worst = 0.0;
    int first = 0;
    for (int k = 0; k < kScans; ++k) {
      const double way_m = WayOf(kScanPeriod * k) - kLapM;
      if (way_m < 0.0) continue;
      while (WayOf(kScanPeriod * first) < way_m) ++first;
      const SE3 truth = Drive(kScanPeriod * first).Inverse() * Drive(kScanPeriod * k);
      const SE3 found = system->PoseOf(first).Inverse() * system->PoseOf(k);
      worst = std::max(worst, TranslationError(found, truth));
    }
    return worst;
  }
};

Lap RunLap(LoopMode mode, Schedule schedule, int threads, int scans = kScans) {
  SlamConfig config;
  config.system.schedule = schedule;
  config.system.threads = threads;
  config.loops.mode = mode;
  config.loops.closer.search.drift_percent = 1.0;  // bent as the world is
  config.mapper.schedule.steps_new = config.mapper.schedule.steps_near = 2;
  config.mapper.feedback.max_keyframe_age =
      20;  // the first lap is not what the second is tracked by
  Lap lap;
  lap.system = SlamSystem::Create(config, NearSensor()).value();
  for (const Scan& scan : std::span(BentScans()).first(static_cast<std::size_t>(scans))) {
    lap.records.push_back(*lap.system->Process(scan));
  }
  lap.system->Finish();
  return lap;
}

int Accepted(const Lap& lap) {
  return static_cast<int>(lap.system->Loops()->Count(LoopFate::kAccepted));
}

TEST(LoopsInSlam, AreClosedWhileTrackingGoesOn) {
  if (kSanitized) GTEST_SKIP() << "a whole lap takes too long";
  const Lap open = RunLap(LoopMode::kOff, Schedule::kLockstep, 2);
  const Lap closed = RunLap(LoopMode::kOn, Schedule::kLockstep, 2);
  std::printf("gap %.2f m open, %.3f m closed by %d of %zu loops\n",
              open.Gap(),
              closed.Gap(),
              Accepted(closed),
              closed.system->Loops()->Loops().size());
  EXPECT_EQ(open.system->Loops(), nullptr);
  EXPECT_GT(open.Gap(), 0.5);
  EXPECT_GE(Accepted(closed), 2);
  EXPECT_LT(closed.Gap(), 0.15);
  int lost = 0;
  for (std::size_t i = 1; i < closed.records.size(); ++i) {
    lost += closed.records[i].state == TrackState::kLost ? 1 : 0;
    // The tracker does not notice: step by step it goes the same way.
    const SE3 step = open.records[i - 1].T_map_sensor.Inverse() * open.records[i].T_map_sensor;
    const SE3 found = closed.system->PoseOf(static_cast<std::int64_t>(i) - 1).Inverse() *
                      closed.system->PoseOf(static_cast<std::int64_t>(i));
    EXPECT_LT(TranslationError(step, found), 0.05) << i;
    EXPECT_LT(RotationError(step, found), 0.01) << i;
  }
  EXPECT_EQ(lost, 0);
}

TEST(LoopsInSlam, AreTheSameForAnyNumberOfThreads) {
  if (kSanitized) GTEST_SKIP() << "a whole lap takes too long";
  const Lap one = RunLap(LoopMode::kOn, Schedule::kLockstep, 1);
  const Lap two = RunLap(LoopMode::kOn, Schedule::kLockstep, 2);
  ASSERT_EQ(one.system->Loops()->Loops().size(), two.system->Loops()->Loops().size());
  for (int k = 0; k < kScans; ++k) {
    EXPECT_EQ(one.system->PoseOf(k).Translation(), two.system->PoseOf(k).Translation()) << k;
  }
}

TEST(LoopsInSlam, AreClosedAtTheEndIfSoWanted) {
  if (kSanitized) GTEST_SKIP() << "a whole lap takes too long";
  const Lap lap = RunLap(LoopMode::kOffline, Schedule::kLockstep, 2);
  EXPECT_GE(Accepted(lap), 2);
  EXPECT_LT(lap.Gap(), 0.15);
}

TEST(LoopsInSlam, LoseNothingWhereverARunIsStopped) {
  for (const int scans : {kScans / 10, kScans - kScans / 8, kScans - kScans / 25}) {
    const Lap lap = RunLap(LoopMode::kOn, Schedule::kThreaded, 2, scans);
    ASSERT_EQ(static_cast<int>(lap.records.size()), scans);
    for (int k = 1; k < scans; ++k) {
      const SE3 step = lap.system->PoseOf(k - 1).Inverse() * lap.system->PoseOf(k);
      EXPECT_LT(step.Translation().norm(), 1.5) << scans << ", " << k;
    }
    EXPECT_GT(lap.system->GetMapper().Map().Size(), 0u);
  }
}

TEST(LoopsInSlam, HaveAThreadOfTheirOwn) {
  const Lap lap = RunLap(LoopMode::kOn, Schedule::kThreaded, 2);
  ASSERT_NE(lap.system->Loops(), nullptr);
  EXPECT_EQ(static_cast<int>(lap.system->Loops()->Poses().size()),
            lap.system->GetMapper().Map().Keyframes());
  if (kSanitized) return;
  EXPECT_GE(Accepted(lap), 2);
  EXPECT_LT(lap.Gap(), 0.15);
}

}  // namespace
}  // namespace covsplat::test
