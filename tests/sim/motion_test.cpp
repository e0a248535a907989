#include "covsplat/sim/motion.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "covsplat/sim/courtyard.hpp"
#include "covsplat/sim/scene.hpp"
#include "covsplat/sim/street.hpp"
#include "covsplat/sim/tunnel.hpp"

namespace covsplat {
namespace {

constexpr double kStepS = 0.01;

class CourtyardWalk : public testing::TestWithParam<int> {
 protected:
  Motion motion_ = MakeMotion("handheld", CourtyardRoute(), 1, GetParam()).value();
};
INSTANTIATE_TEST_SUITE_P(Seeds, CourtyardWalk, testing::Values(1, 2, 3));

TEST_P(CourtyardWalk, StandsStillThenWalksRoundAndReturns) {
  for (const double time_s : {0.2, 0.5}) {
    EXPECT_LT((motion_.PoseAt(0.0).Inverse() * motion_.PoseAt(time_s)).Log().norm(), 1e-9);
  }
  const SE3 there_and_back = motion_.PoseAt(0.0).Inverse() * motion_.PoseAt(motion_.Duration());
  EXPECT_LT(there_and_back.Log().norm(), 1e-9);

  double length_m = 0.0;
  for (double time_s = 0.0; time_s < motion_.Duration(); time_s += kStepS) {
    length_m +=
        (motion_.PoseAt(time_s + kStepS).Translation() - motion_.PoseAt(time_s).Translation())
            .head<2>()
            .norm();
  }
  EXPECT_GT(length_m, 60.0);
  EXPECT_LT(length_m, 80.0);
  EXPECT_GT(length_m / motion_.Duration(), 0.9);
}

TEST_P(CourtyardWalk, MovesLikeAPerson) {
  double fastest = 0.0;
  double hardest = 0.0;
  double quickest_turn = 0.0;
  for (double time_s = 0.0; time_s < motion_.Duration(); time_s += kStepS) {
    const SE3 before = motion_.PoseAt(time_s - kStepS);
    const SE3 here = motion_.PoseAt(time_s);
    const SE3 after = motion_.PoseAt(time_s + kStepS);
    const Eigen::Vector3d velocity = (after.Translation() - before.Translation()) / (2.0 * kStepS);
    const Eigen::Vector3d acceleration =
        (after.Translation() - 2.0 * here.Translation() + before.Translation()) / (kStepS * kStepS);
    fastest = std::max(fastest, velocity.norm());
    hardest = std::max(hardest, acceleration.norm());
    quickest_turn =
        std::max(quickest_turn, (here.Inverse() * after).Log().head<3>().norm() / kStepS);
    EXPECT_GT((here.Rotation() * Eigen::Vector3d::UnitZ()).z(), std::cos(0.12)) << "tilt";
  }
  EXPECT_GT(fastest, 1.2);
  EXPECT_LT(fastest, 1.7);
  EXPECT_GT(hardest, 2.0);  // it does bounce
  EXPECT_LT(hardest, 6.0);  // m/s^2: 3 cm at 2 Hz alone are 4.7
  EXPECT_LT(quickest_turn, 2.0);
}

TEST_P(CourtyardWalk, AccelerationHasNoJumps) {
  constexpr double kTinyS = 1e-3;
  const auto acceleration = [&](double time_s) -> Eigen::Vector3d {
    return (motion_.PoseAt(time_s + kTinyS).Translation() -
            2.0 * motion_.PoseAt(time_s).Translation() +
            motion_.PoseAt(time_s - kTinyS).Translation()) /
           (kTinyS * kTinyS);
  };
  for (double time_s = 0.0; time_s < motion_.Duration(); time_s += 4.0 * kTinyS) {
    const double jump = (acceleration(time_s + 4.0 * kTinyS) - acceleration(time_s)).norm();
    EXPECT_LT(jump, 0.4) << time_s;  // jerk within 100 m/s^3
  }
}

TEST_P(CourtyardWalk, KeepsInsideAndClearOfEverything) {
  const Scene scene(MakeCourtyard(GetParam()));
  for (double time_s = 0.0; time_s < motion_.Duration(); time_s += 5.0 * kStepS) {
    const Eigen::Vector3d position = motion_.PoseAt(time_s).Translation();
    EXPECT_LT(std::abs(position.x()), 14.5);
    EXPECT_LT(std::abs(position.y()), 11.5);
    EXPECT_FALSE(scene.DistanceTo(position.cast<float>(), 0.3f)) << "at " << position.transpose();
    // Nothing in the way of the body either.
    const Eigen::Vector3f waist = position.cast<float>() - Eigen::Vector3f(0.0f, 0.0f, 0.7f);
    EXPECT_FALSE(scene.DistanceTo(waist, 0.3f)) << "at " << position.transpose();
    const auto ground = scene.Cast(position.cast<float>(), -Eigen::Vector3f::UnitZ(), 3.0f);
    ASSERT_TRUE(ground);
    EXPECT_NEAR(ground->range_m, 1.5, 0.1);
  }
}

TEST(MakeMotion, WhatCannotBeIsAnError) {
  EXPECT_FALSE(MakeMotion("teleport", CourtyardRoute(), 1, 1));
  EXPECT_FALSE(MakeMotion("handheld", CourtyardRoute(), 0, 1));
  EXPECT_FALSE(MakeMotion("vehicle", TunnelRoute(), 2, 1)) << "an open route has no laps";
  Route short_one;
  short_one.controls.resize(3);
  EXPECT_FALSE(MakeMotion("handheld", short_one, 1, 1));
}

TEST(MakeMotion, LapsGoRoundAgainAndEndWhereTheyBegan) {
  const Motion once = MakeMotion("walking", CourtyardRoute(), 1, 1).value();
  const Motion thrice = MakeMotion("walking", CourtyardRoute(), 3, 1).value();
  EXPECT_GT(thrice.Duration(), 2.5 * once.Duration());
  const SE3 there_and_back = thrice.PoseAt(0.0).Inverse() * thrice.PoseAt(thrice.Duration());
  EXPECT_LT(there_and_back.Log().norm(), 1e-9);
}

TEST(MakeMotion, ABackIsSteadierThanAHand) {
  const auto tilt_of = [](const Motion& motion) {
    double sum = 0.0;
    for (double time_s = 3.0; time_s < 30.0; time_s += 0.05) {
      const double up = (motion.PoseAt(time_s).Rotation() * Eigen::Vector3d::UnitZ()).z();
      sum += std::acos(std::min(up, 1.0));
    }
    return sum;
  };
  EXPECT_LT(tilt_of(MakeMotion("walking", CourtyardRoute(), 1, 1).value()),
            0.6 * tilt_of(MakeMotion("handheld", CourtyardRoute(), 1, 1).value()));
}

TEST(MakeMotion, AVehicleKeepsToItsSpeedsAndHardlyLeans) {
  const Motion motion = MakeMotion("vehicle", StreetRoute(), 1, 1).value();
  double fastest = 0.0;
  double slowest = 1e9;
  double hardest = 0.0;
  double length_m = 0.0;
  for (double time_s = kStepS; time_s < motion.Duration(); time_s += kStepS) {
    const SE3 before = motion.PoseAt(time_s - kStepS);
    const SE3 here = motion.PoseAt(time_s);
    const SE3 after = motion.PoseAt(time_s + kStepS);
    const double speed = (after.Translation() - before.Translation()).norm() / (2.0 * kStepS);
    fastest = std::max(fastest, speed);
    if (time_s > 9.0 && time_s < motion.Duration() - 9.0) slowest = std::min(slowest, speed);
    hardest = std::max(
        hardest,
        (after.Translation() - 2.0 * here.Translation() + before.Translation()).head<2>().norm() /
            (kStepS * kStepS));
    length_m += 0.5 * speed * 2.0 * kStepS;
    EXPECT_GT((here.Rotation() * Eigen::Vector3d::UnitZ()).z(), std::cos(0.04)) << time_s;
    // It drives where it looks.
    if (speed > 3.0) {
      const Eigen::Vector3d course = (after.Translation() - before.Translation()).normalized();
      EXPECT_GT((here.Rotation() * Eigen::Vector3d::UnitX()).dot(course), std::cos(0.08));
    }
  }
  EXPECT_GT(length_m, 600.0);
  EXPECT_GT(fastest, 9.0);
  EXPECT_LT(fastest, 12.0);
  EXPECT_GT(slowest, 5.0);
  EXPECT_LT(hardest, 5.0);
}

TEST(MotionAlong, FollowsItsPosesSmoothly) {
  Trajectory circle;
  for (int i = 0; i <= 100; ++i) {
    const double angle = 0.02 * i;
    const Eigen::Quaterniond heading(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
    const Eigen::Vector3d position(10.0 * std::sin(angle), 10.0 * (1.0 - std::cos(angle)), 0.5);
    circle.push_back({5.0 + 0.1 * i, SE3(heading, position)});
  }
  const Motion motion = MotionAlong(circle);
  EXPECT_NEAR(motion.Duration(), 10.0, 1e-9);
  for (std::size_t i = 3; i + 3 < circle.size(); ++i) {
    const SE3 off = circle[i].T_world_sensor.Inverse() * motion.PoseAt(circle[i].stamp_s - 5.0);
    EXPECT_LT(off.Log().norm(), 2e-3) << i;
  }
  for (double time_s = -1.0; time_s < 11.0; time_s += 1e-3) {
    const Eigen::Vector3d step =
        motion.PoseAt(time_s + 1e-3).Translation() - motion.PoseAt(time_s).Translation();
    EXPECT_LT(step.norm(), 2.1e-3) << time_s;
  }
}

TEST(Path, FollowsLinesAndRoundsTheirCorners) {
  const Path path(AlongLines({{0, 0, 0}, {10, 0, 0}, {10, 10, 2}}, false, 1.0), false);
  EXPECT_EQ(path.At(-1.0), path.At(0.0));
  EXPECT_LT((path.At(0.0) - Eigen::Vector3d::Zero()).norm(), 1e-9);
  EXPECT_LT((path.At(path.Length()) - Eigen::Vector3d(10, 10, 2)).norm(), 1e-9);
  EXPECT_NEAR(path.At(5.0).y(), 0.0, 1e-9);
  EXPECT_NEAR(path.Heading(5.0), 0.0, 1e-9);
  EXPECT_NEAR(path.Slope(15.0), 0.2, 1e-6);
  EXPECT_LT(path.Length(), 10.0 + std::hypot(10.0, 2.0));
}

}  // namespace
}  // namespace covsplat
