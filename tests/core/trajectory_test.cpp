#include "covsplat/core/trajectory.hpp"

#include <gtest/gtest.h>

namespace covsplat {
namespace {

Trajectory StraightLine() {
  Trajectory trajectory;
  for (const double stamp_s : {0.0, 1.0, 2.0, 10.0}) {
    trajectory.push_back(
        {stamp_s, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(stamp_s, 0.0, 0.0))});
  }
  return trajectory;
}

TEST(Trajectory, InterpolatesBetweenSamples) {
  EXPECT_NEAR(PoseAt(StraightLine(), 1.25, 2.0)->Translation().x(), 1.25, 1e-12);
  EXPECT_NEAR(PoseAt(StraightLine(), 2.0, 2.0)->Translation().x(), 2.0, 1e-12);
  EXPECT_NEAR(PoseAt(StraightLine(), 0.0, 2.0)->Translation().x(), 0.0, 1e-12);
}

TEST(Trajectory, DoesNotInventPosesOutsideOrAcrossAGap) {
  EXPECT_FALSE(PoseAt(StraightLine(), -0.1, 2.0));
  EXPECT_FALSE(PoseAt(StraightLine(), 10.1, 2.0));
  EXPECT_FALSE(PoseAt(StraightLine(), 5.0, 2.0));
  EXPECT_FALSE(PoseAt({}, 0.0, 2.0));
}

}  // namespace
}  // namespace covsplat
