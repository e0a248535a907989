#include "covsplat/sim/simulated_lidar.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "covsplat/core/range_image.hpp"
#include "covsplat/sim/courtyard.hpp"

namespace covsplat {
namespace {

SimulatedLidarConfig Noiseless() {
  SimulatedLidarConfig config;
  config.rows = 32;
  config.columns = 512;
  config.range_noise_m = 0.0;
  config.dropout_probability = 0.0;
  config.grazing_deg = 0.0;
  config.mixed_pixel_probability = 0.0;
  return config;
}

// A closed room, so that every ray returns.
Scene Room() {
  MeshBuilder mesh;
  mesh.Box({1.0f, -0.5f, -2.0f}, {9.0f, 7.0f, 5.0f}, 0.3f, 0.5f);
  return Scene(std::move(mesh).Take());
}

Motion Standing() {
  return {10.0, [](double) { return SE3(); }};
}

// Fast, in all six degrees of freedom.
Motion Tumbling() {
  return {10.0, [](double time_s) {
            Vector6d twist;
            twist << 0.3, -0.2, 1.5, 1.2, 0.5, -0.3;
            return SE3::Exp((time_s - 0.35) * twist);
          }};
}

TEST(SimulateScan, EveryBeamFillsItsOwnPixel) {
  const SimulatedLidarConfig config = Noiseless();
  ThreadPool pool(2);
  const Scan scan = SimulateScan({Room(), {}}, Standing(), config, 0, pool);
  const SensorModel sensor = ModelOf(config);
  ASSERT_EQ(scan.points.size(), static_cast<std::size_t>(config.rows * config.columns));
  const RangeImage image = ProjectScan(sensor, scan.points);
  for (int row = 0; row < config.rows; ++row) {
    for (int column = 0; column < config.columns; ++column) {
      // Column by column, top first.
      EXPECT_EQ(image.point_index(row, column), column * config.rows + row);
    }
  }
}

TEST(SimulateScan, TimesRunFromTheRearClockwiseRoundTheStamp) {
  const SimulatedLidarConfig config = Noiseless();
  ThreadPool pool(1);
  const Scan scan = SimulateScan({Room(), {}}, Standing(), config, 7, pool);
  EXPECT_NEAR(scan.stamp_s, 0.75, 1e-12);
  ASSERT_EQ(scan.time_offset_s.size(), scan.points.size());
  const double half_column_s = 0.5 / (config.scan_rate_hz * config.columns);
  EXPECT_NEAR(scan.time_offset_s.front(), -0.05 + half_column_s, 1e-8);
  EXPECT_NEAR(scan.time_offset_s.back(), 0.05 - half_column_s, 1e-8);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double azimuth = std::atan2(scan.points[i].y(), scan.points[i].x());
    const double phase = static_cast<double>(scan.time_offset_s[i]) * config.scan_rate_hz;
    EXPECT_NEAR(azimuth, -2.0 * std::numbers::pi * phase, 1e-5);
  }
}

TEST(SimulateScan, DeskewingWithTheTrueMotionPutsPointsBackOnTheSurfaces) {
  constexpr float kOnSurfaceM = 1e-4f;
  const SimulatedLidarConfig config = Noiseless();
  ThreadPool pool(2);
  const Scene courtyard(MakeCourtyard(1));
  const Motion walk = MakeMotion("handheld", CourtyardRoute(), 1, 1).value();
  const Scene room = Room();
  const Motion tumbling = Tumbling();
  const std::pair<const Scene*, const Motion*> cases[] = {{&courtyard, &walk}, {&room, &tumbling}};
  for (const auto& [scene, motion] : cases) {
    const Scan raw = SimulateScan({*scene, {}}, *motion, config, 20, pool);
    const Scan deskewed = Deskewed(raw, *motion);
    const SE3 T_world_middle = motion->PoseAt(raw.stamp_s);
    float largest_skew_m = 0.0f;
    for (std::size_t i = 0; i < raw.points.size(); ++i) {
      const Eigen::Vector3d point_world = T_world_middle * deskewed.points[i].cast<double>().eval();
      EXPECT_TRUE(scene->DistanceTo(point_world.cast<float>(), kOnSurfaceM)) << i;
      largest_skew_m = std::max(largest_skew_m, (raw.points[i] - deskewed.points[i]).norm());
    }
    EXPECT_GT(largest_skew_m, motion == &tumbling ? 0.1f : 0.001f);
    EXPECT_TRUE(deskewed.time_offset_s.empty());
  }
}

TEST(SimulateScan, IsTheSameForAnyNumberOfThreads) {
  SimulatedLidarConfig config;
  config.rows = 16;
  const Scene scene(MakeCourtyard(1));
  const Motion motion = MakeMotion("handheld", CourtyardRoute(), 1, 1).value();
  ThreadPool one(1);
  ThreadPool two(2);
  const Scan first = SimulateScan({scene, {}}, motion, config, 100, one);
  const Scan second = SimulateScan({scene, {}}, motion, config, 100, two);
  EXPECT_EQ(first.points, second.points);
  EXPECT_EQ(first.intensity, second.intensity);
  EXPECT_EQ(first.time_offset_s, second.time_offset_s);
  config.seed = 2;
  EXPECT_NE(SimulateScan({scene, {}}, motion, config, 100, two).points, first.points);
}

TEST(SimulateScan, RangeNoiseHasItsDeviationAndNoBias) {
  SimulatedLidarConfig config = Noiseless();
  ThreadPool pool(2);
  const Scan exact = SimulateScan({Room(), {}}, Standing(), config, 0, pool);
  config.range_noise_m = 0.02;
  const Scan noisy = SimulateScan({Room(), {}}, Standing(), config, 0, pool);
  ASSERT_EQ(noisy.points.size(), exact.points.size());
  double sum = 0.0;
  double sum2 = 0.0;
  for (std::size_t i = 0; i < exact.points.size(); ++i) {
    const double error = noisy.points[i].norm() - exact.points[i].norm();
    sum += error;
    sum2 += error * error;
    EXPECT_LT(noisy.points[i].normalized().cross(exact.points[i].normalized()).norm(), 1e-6);
  }
  const auto n = static_cast<double>(exact.points.size());
  EXPECT_NEAR(sum / n, 0.0, 4.0 * 0.02 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(sum2 / n), 0.02, 4.0 * 0.02 / std::sqrt(2.0 * n));
}

TEST(SimulateScan, ReturnsAreLostAtRandomOutOfReachAndAtGrazingIncidence) {
  const Scene room = Room();
  ThreadPool pool(1);
  SimulatedLidarConfig config = Noiseless();
  const auto n = static_cast<double>(config.rows * config.columns);
  config.dropout_probability = 0.2;
  const auto kept =
      static_cast<double>(SimulateScan({room, {}}, Standing(), config, 0, pool).points.size());
  EXPECT_NEAR(kept / n, 0.8, 4.0 * std::sqrt(0.16 / n));

  config = Noiseless();
  config.min_range_m = 3.0;
  config.max_range_m = 4.0;
  for (const Eigen::Vector3f& point :
       SimulateScan({room, {}}, Standing(), config, 0, pool).points) {
    EXPECT_GT(point.norm(), 3.0f);
    EXPECT_LT(point.norm(), 4.0f);
  }

  MeshBuilder mesh;
  mesh.Quad({-90, -90, -1}, {90, -90, -1}, {90, 90, -1}, {-90, 90, -1}, 0.5f);
  const Scene floor(std::move(mesh).Take());
  config = Noiseless();
  config.grazing_deg = 5.0;
  const Scan scan = SimulateScan({floor, {}}, Standing(), config, 0, pool);
  EXPECT_FALSE(scan.points.empty());
  for (const Eigen::Vector3f& point : scan.points) {
    EXPECT_LT(point.norm(), 1.0 / std::sin(5.0 * std::numbers::pi / 180.0));
  }
}

TEST(SimulateScan, IntensityStaysWithinItsBounds) {
  ThreadPool pool(1);
  for (const float intensity : SimulateScan({Room(), {}}, Standing(), {}, 0, pool).intensity) {
    EXPECT_GE(intensity, 0.0f);
    EXPECT_LE(intensity, 1.0f);
  }
}

}  // namespace
}  // namespace covsplat
