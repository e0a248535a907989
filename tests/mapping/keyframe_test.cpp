#include "covsplat/mapping/keyframe.hpp"

#include <cmath>
#include <limits>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.01;

TEST(Overlap, IsTheShareOfPointsNearerThanTheLimit) {
  const float unmatched = std::numeric_limits<float>::infinity();
  const std::vector<float> squared = {0.0f, 0.08f, 0.1f, unmatched};
  EXPECT_EQ(Overlap(squared, 0.3), 0.5);  // 0.28 m is near, 0.32 m is not
  EXPECT_EQ(Overlap(squared, 10.0), 0.75);
}

TEST(Overlap, IsZeroWithoutPoints) { EXPECT_EQ(Overlap({}, 0.3), 0.0); }

TEST(MakeKeyframe, ShowsTheNearestPointOfEveryPixel) {
  ThreadPool pool(2);
  TrackedScan tracked = TrackedStill(Room(), ReducedSensor(), SE3(), kNoise, 1, pool);
  tracked.surface.clear();
  tracked.covariance.clear();
  tracked.squared_distance.clear();
  const Keyframe keyframe = MakeKeyframe(tracked, ReducedSensor(), 0.5, pool);
  std::size_t returns = 0;
  for (std::size_t i = 0; i < keyframe.point.Size(); ++i) {
    const int point = keyframe.point.Pixels()[i];
    const float range = keyframe.measurement.range_m.Pixels()[i];
    if (point < 0) {
      EXPECT_EQ(range, 0.0f);
      continue;
    }
    ++returns;
    EXPECT_EQ(range, keyframe.tracked.points[static_cast<std::size_t>(point)].norm());
  }
  EXPECT_GT(returns, keyframe.point.Size() * 9 / 10);  // a closed room
}

TEST(MakeKeyframe, RangesOnSurfacesAreThoseOfThePixelsRays) {
  // A slanted wall, measured many times in every pixel.
  const SensorModel sensor = ReducedSensor();
  const Eigen::Vector3f normal = Eigen::Vector3f(-1.0f, -0.8f, 0.1f).normalized();
  constexpr float kDistance = -6.0f;
  ThreadPool pool(2);
  TrackedScan tracked;
  Rng rng(3);
  for (int i = 0; i < 40000; ++i) {
    const double azimuth = rng.Uniform(-0.4, 0.6);
    const double elevation = rng.Uniform(-0.2, 0.2);
    const Eigen::Vector3f ray = Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                std::cos(elevation) * std::sin(azimuth),
                                                std::sin(elevation))
                                    .cast<float>();
    tracked.points.push_back(kDistance / normal.dot(ray) * ray);
  }
  PointCovariance covariance;
  covariance.axes.col(2) = normal;
  covariance.axes.col(0) = normal.unitOrthogonal();
  covariance.axes.col(1) = normal.cross(covariance.axes.col(0));
  covariance.sigma_m = {0.2f, 0.2f, 0.001f};
  for (std::size_t i = 0; i < tracked.points.size(); i += 10) {
    tracked.surface.push_back(tracked.points[i]);
    tracked.covariance.push_back(covariance);
    tracked.squared_distance.push_back(0.0f);
  }
  const Keyframe keyframe = MakeKeyframe(tracked, sensor, 0.5, pool);
  double drawn_nearer_m = 0.0;
  int count = 0;
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const int point = keyframe.point(row, column);
      if (point < 0) continue;
      const float exact = kDistance / normal.dot(sensor.RayOf(row, column));
      EXPECT_NEAR(keyframe.measurement.range_m(row, column), exact, 1e-4f * exact);
      drawn_nearer_m += exact - tracked.points[static_cast<std::size_t>(point)].norm();
      ++count;
    }
  }
  ASSERT_GT(count, 100);
  EXPECT_GT(drawn_nearer_m / count, 0.01) << "the nearest measurements would not do";
}

TEST(MakeKeyframe, GivesEveryPixelItsNearestSurfaceAndANormalThatFacesTheSensor) {
  ThreadPool pool(2);
  const SE3 pose = MakePose(0.1, -0.05, 0.8, 1.0, 2.0, 0.3);
  const Keyframe keyframe = StillKeyframe(Room(), ReducedSensor(), pose, kNoise, 1, pool);
  const TrackedScan& scan = keyframe.tracked;
  constexpr std::size_t kEvery = 7;  // the comparison is quadratic
  for (std::size_t i = 0; i < keyframe.point.Size(); i += kEvery) {
    const int point = keyframe.point.Pixels()[i];
    if (point < 0) continue;
    const Eigen::Vector3f& p = scan.points[static_cast<std::size_t>(point)];
    float nearest = std::numeric_limits<float>::infinity();
    for (const Eigen::Vector3f& q : scan.surface) {
      nearest = std::min(nearest, (p - q).squaredNorm());
    }
    ASSERT_GE(keyframe.surface.Pixels()[i], 0) << "a source point per 0.4 m is within 0.5 m";
    const auto surface = static_cast<std::size_t>(keyframe.surface.Pixels()[i]);
    EXPECT_EQ((p - scan.surface[surface]).squaredNorm(), nearest);
    const Eigen::Vector3f& normal = keyframe.measurement.normal.Pixels()[i];
    EXPECT_LE(normal.dot(p), 0.0f);
    EXPECT_EQ(normal.cwiseAbs(), scan.covariance[surface].axes.col(2).cwiseAbs());
  }
}

TEST(MakeKeyframe, LeavesPixelsFarFromAnySourcePointWithoutASurface) {
  ThreadPool pool(2);
  TrackedScan tracked = TrackedStill(Room(), ReducedSensor(), SE3(), kNoise, 1, pool);
  TrackedScan front = tracked;
  front.surface.clear();
  front.covariance.clear();
  front.squared_distance.clear();
  for (std::size_t i = 0; i < tracked.surface.size(); ++i) {
    if (tracked.surface[i].x() < 0.0f) continue;
    front.surface.push_back(tracked.surface[i]);
    front.covariance.push_back(tracked.covariance[i]);
    front.squared_distance.push_back(tracked.squared_distance[i]);
  }
  const Keyframe keyframe = MakeKeyframe(front, ReducedSensor(), kMaxSurfaceDistance, pool);
  std::size_t behind = 0;
  for (std::size_t i = 0; i < keyframe.point.Size(); ++i) {
    const int point = keyframe.point.Pixels()[i];
    if (point < 0) continue;
    const Eigen::Vector3f& p = keyframe.tracked.points[static_cast<std::size_t>(point)];
    if (p.x() > -kMaxSurfaceDistance) continue;
    ++behind;
    EXPECT_EQ(keyframe.surface.Pixels()[i], -1);
    EXPECT_TRUE(keyframe.measurement.normal.Pixels()[i].isZero());
    EXPECT_GT(keyframe.measurement.range_m.Pixels()[i], 0.0f) << "its range is still supervision";
  }
  EXPECT_GT(behind, keyframe.point.Size() / 4);
}

TEST(MakeKeyframe, TakesAnEmptyScan) {
  ThreadPool pool(2);
  const Keyframe keyframe = MakeKeyframe({}, ReducedSensor(), kMaxSurfaceDistance, pool);
  EXPECT_EQ(keyframe.point.Rows(), 32);
  for (const int point : keyframe.point.Pixels()) EXPECT_EQ(point, -1);
}

}  // namespace
}  // namespace covsplat::test
