#include "covsplat/sim/motion.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "covsplat/sim/scene.hpp"
#include "covsplat/sim/worlds.hpp"

namespace covsplat {
namespace {

constexpr double kStepS = 0.01;

class CourtyardWalk : public testing::TestWithParam<int> {
 protected:
  Motion motion_ = MakeMotion("courtyard", "handheld", GetParam()).value();
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
  const Scene scene(MakeWorld("courtyard", GetParam()).value());
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

TEST(MakeMotion, UnknownNamesAreErrors) {
  EXPECT_FALSE(MakeMotion("atlantis", "handheld", 1));
  EXPECT_FALSE(MakeMotion("courtyard", "teleport", 1));
}

}  // namespace
}  // namespace covsplat
