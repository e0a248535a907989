#include "covsplat/loops/loop_closer.hpp"

#include <cstdio>

#include "tests/loops/block_city.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kStepM = 2.0;
constexpr int kLap = 100;  // keyframes

class LoopCloserTest : public ::testing::Test {
 protected:
  /// Keyframes round the block with odometry that always errs the same way.
  void Drive(LoopCloser& closer, int keyframes, const Vector6d& error_per_step) {
    SE3 T_odom = RoundTheBlock(0.0);
    for (int k = 0; k < keyframes; ++k) {
      const SE3 truth = RoundTheBlock(kStepM * k);
      if (k > 0) {
        T_odom =
            T_odom * (RoundTheBlock(kStepM * (k - 1)).Inverse() * truth) * SE3::Exp(error_per_step);
      }
      LoopKeyframe keyframe;
      keyframe.T_odom_keyframe = T_odom;
      keyframe.place = PlaceAt(city_, k, truth, 1000 + static_cast<std::uint64_t>(k), pool_);
      corrections_ += closer.Add(std::move(keyframe)) ? 1 : 0;
    }
    T_odom_last_ = T_odom;
  }

  static Vector6d Drift(double turn_rad, double climb_m) {
    return (Vector6d() << 0.0, 0.0, turn_rad, 0.0, 0.0, climb_m).finished();
  }

  ThreadPool pool_{2};
  const RayScene city_ = BlockCity();
  int corrections_ = 0;
  SE3 T_odom_last_;
};

TEST_F(LoopCloserTest, ALapThatDriftedIsClosed) {
  LoopCloser closer({}, pool_);
  Drive(closer, kLap + 20, Drift(2e-4, 0.004));
  const double drift = TranslationError(T_odom_last_, RoundTheBlock(kStepM * (kLap + 19)));
  double worst = 0.0;
  for (int k = 0; k < kLap + 20; ++k) {
    worst = std::max(
        worst,
        TranslationError(closer.Poses()[static_cast<std::size_t>(k)], RoundTheBlock(kStepM * k)));
  }
  std::printf("drift %.2f m, afterwards %.3f m at most; %zu looked at, %lld accepted\n",
              drift,
              worst,
              closer.Loops().size(),
              static_cast<long long>(closer.Count(LoopFate::kAccepted)));
  EXPECT_GT(drift, 0.6);
  EXPECT_GE(closer.Count(LoopFate::kAccepted), 2);
  EXPECT_GE(corrections_, 1);
  // Where the lap meets itself it fits.
  for (int k = kLap; k < kLap + 20; ++k) {
    const SE3& second = closer.Poses()[static_cast<std::size_t>(k)];
    const SE3& first = closer.Poses()[static_cast<std::size_t>(k - kLap)];
    EXPECT_LT(TranslationError(first, second), 0.05) << k;
  }
  EXPECT_LT(worst, 0.5 * drift);
}

TEST_F(LoopCloserTest, LittleMemoryOfPlacesIsEnoughToCloseALap) {
  LoopCloser whole({}, pool_);
  Drive(whole, kLap + 20, Drift(2e-4, 0.004));
  LoopConfig config;
  config.max_places_mb = 0.5 * static_cast<double>(whole.PlacesBytes()) / 1e6;
  LoopCloser bounded(config, pool_);
  Drive(bounded, kLap + 20, Drift(2e-4, 0.004));
  EXPECT_LE(static_cast<double>(bounded.PlacesBytes()), 1e6 * config.max_places_mb);
  EXPECT_GE(bounded.Count(LoopFate::kAccepted), 2);
  EXPECT_EQ(bounded.Count(LoopFate::kUndone), 0);
}

TEST_F(LoopCloserTest, WithoutDriftNothingMoves) {
  LoopCloser closer({}, pool_);
  Drive(closer, kLap + 10, Drift(0.0, 0.0));
  EXPECT_GE(closer.Count(LoopFate::kAccepted), 2);
  for (int k = 0; k < kLap + 10; ++k) {
    EXPECT_LT(
        TranslationError(closer.Poses()[static_cast<std::size_t>(k)], RoundTheBlock(kStepM * k)),
        0.02);
  }
}

TEST_F(LoopCloserTest, WhatHasDriftedTooFarForItsPoseIsKnownByItsLooks) {
  LoopConfig config;
  config.search.drift_m = 0.2;
  config.search.drift_percent = 0.05;
  config.search.reach_m = 0.1;
  LoopCloser closer(config, pool_);
  Drive(closer, kLap + 30, Drift(2e-4, 0.0));
  int by_looks = 0;
  for (const LoopRecord& loop : closer.Loops()) {
    if (loop.check.fate != LoopFate::kAccepted) continue;
    by_looks += loop.hint == LoopHint::kLooks ? 1 : 0;
    const SE3 truth = RoundTheBlock(kStepM * loop.old_keyframe).Inverse() *
                      RoundTheBlock(kStepM * loop.new_keyframe);
    EXPECT_LT(TranslationError(loop.check.T_old_new, truth), 0.05);
  }
  EXPECT_GE(by_looks, 2);
}

TEST_F(LoopCloserTest, NoLoopIsFarFromWhatOdometryAllows) {
  LoopConfig config;
  config.search.drift_percent = 0.01;
  config.search.drift_m = 0.05;
  config.looks.enabled = false;
  LoopCloser closer(config, pool_);
  Drive(closer, kLap + 10, Drift(2e-4, 0.004));
  EXPECT_EQ(closer.Count(LoopFate::kAccepted), 0);
  EXPECT_GE(closer.Count(LoopFate::kTooFar), 1);
  EXPECT_EQ(corrections_, 0);
}

TEST_F(LoopCloserTest, APlaceOnTheSameFloorIsLookedAtBeforeOneRightBelow) {
  constexpr int kLeg = 25;  // keyframes; the same way on two floors, upstairs 8 m aside at first
  const SE3 upstairs(Eigen::Quaterniond::Identity(), {0.0, 0.0, 3.0});
  const SE3 aside(Eigen::Quaterniond::Identity(), {0.0, 8.0, 0.0});
  LoopConfig config;
  config.search.agree_deg = 0.0;  // no loop is to move anything
  LoopCloser closer(config, pool_);
  for (int k = 0; k < 3 * kLeg; ++k) {
    const SE3 truth = RoundTheBlock(kStepM * (k % kLeg));
    LoopKeyframe keyframe;
    keyframe.T_odom_keyframe = k < kLeg       ? truth
                               : k < 2 * kLeg ? upstairs * truth * aside
                                              : upstairs * truth;
    keyframe.place = PlaceAt(city_, k, truth, 1000 + static_cast<std::uint64_t>(k), pool_);
    closer.Add(std::move(keyframe));
  }
  int looked_at = 0;
  for (const LoopRecord& loop : closer.Loops()) {
    if (loop.hint != LoopHint::kPose || loop.new_keyframe < 2 * kLeg) continue;
    EXPECT_GE(loop.old_keyframe, kLeg) << loop.new_keyframe;
    ++looked_at;
  }
  EXPECT_GE(looked_at, 5);
}

}  // namespace
}  // namespace covsplat::test
