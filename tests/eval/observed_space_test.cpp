#include "covsplat/eval/observed_space.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

Trajectory MovingAlongX(double speed_mps) {
  Trajectory truth;
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.1 * i;
    truth.push_back({t, SE3(Eigen::Quaterniond::Identity(), {speed_mps * t, 0.0, 0.0})});
  }
  return truth;
}

std::vector<std::uint8_t> Visible(const ObservedSpace& space,
                                  const std::vector<Eigen::Vector3d>& points) {
  ThreadPool pool(2);
  return space.Visible(points, pool);
}

std::vector<std::uint8_t> Observed(const ObservedSpace& space,
                                   const std::vector<Eigen::Vector3d>& points) {
  ThreadPool pool(2);
  return space.InObservedSpace(points, pool);
}

using Mask = std::vector<std::uint8_t>;

TEST(ObservedSpace, SurfacesNearAReturnAreVisible) {
  ObservedSpace space({});
  Scan scan;
  scan.stamp_s = 0.5;
  scan.points = {{10.0f, 0.0f, 0.0f}};
  EXPECT_EQ(space.Add(scan, MovingAlongX(0.0)), 1u);
  EXPECT_EQ(Visible(space, {{10.0, 0.0, 0.0}, {10.05, 0.0, 0.0}, {10.0, 0.16, 0.0}, {5, 0, 0}}),
            (Mask{1, 1, 0, 0}));
}

TEST(ObservedSpace, PointsAreMovedByTheTruePoseAtTheirOwnTime) {
  ObservedSpace space({});
  Scan scan;
  scan.stamp_s = 1.0;
  scan.points = {{10.0f, 0.0f, 0.0f}, {0.0f, 10.0f, 0.0f}};
  scan.time_offset_s = {-0.05f, 0.05f};
  EXPECT_EQ(space.Add(scan, MovingAlongX(10.0)), 2u);
  EXPECT_EQ(Visible(space, {{19.5, 0.0, 0.0}, {10.5, 10.0, 0.0}, {20.0, 0.0, 0.0}}),
            (Mask{1, 1, 0}));
}

TEST(ObservedSpace, RaysMakeTheSpaceBeforeTheReturnObservedButNotBehindIt) {
  ObservedSpace space({});
  Scan scan;
  scan.stamp_s = 0.0;
  scan.points = {{10.25f, 0.25f, 0.25f}};
  space.Add(scan, MovingAlongX(0.0));
  EXPECT_EQ(Observed(space,
                     {{5.0, 0.2, 0.2},    // on the ray
                      {10.2, 0.2, 0.2},   // at the return
                      {10.8, 0.2, 0.2},   // one cell behind it
                      {12.0, 0.2, 0.2},   // hidden
                      {5.0, 3.0, 0.2}}),  // beside
            (Mask{1, 1, 1, 0, 0}));
}

TEST(ObservedSpace, WhatHasNoPoseOrNoPlaceDoesNotCount) {
  ObservedSpace space({});
  Scan scan;
  scan.stamp_s = 7.0;  // after the truth
  scan.points = {{1.0f, 0.0f, 0.0f}};
  EXPECT_EQ(space.Add(scan, MovingAlongX(0.0)), 0u);
  scan.stamp_s = 1.0;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  scan.points = {{0.0f, 0.0f, 0.0f}, {nan, 1.0f, 1.0f}, {1e9f, 0.0f, 0.0f}};
  EXPECT_EQ(space.Add(scan, MovingAlongX(0.0)), 0u);
  EXPECT_EQ(Visible(space, {{1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}), (Mask{0, 0}));
}

TEST(ObservedSpace, DoesNotDependOnTheOrderOfScans) {
  Scan a, b;
  a.stamp_s = 0.2;
  a.points = {{4.0f, 1.0f, 0.0f}, {3.0f, -2.0f, 1.0f}};
  b.stamp_s = 1.3;
  b.points = {{2.0f, 2.0f, 0.5f}};
  const Trajectory truth = MovingAlongX(1.0);
  ObservedSpace one({}), other({});
  one.Add(a, truth);
  one.Add(b, truth);
  other.Add(b, truth);
  other.Add(a, truth);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 20; ++i) {
    for (int j = -12; j < 12; ++j) points.emplace_back(0.25 * i, 0.25 * j, 0.01 * i);
  }
  EXPECT_EQ(Visible(one, points), Visible(other, points));
  EXPECT_EQ(Observed(one, points), Observed(other, points));
}

}  // namespace
}  // namespace covsplat
