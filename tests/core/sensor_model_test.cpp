#include "covsplat/core/sensor_model.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;

// Denser near the horizon, like an HDL-64E or a QT64.
SensorModel UnevenSensor() {
  std::vector<double> elevation_rad;
  double elevation = 15.0 * kDegree;
  for (int i = 0; i < 40; ++i) {
    elevation_rad.push_back(elevation);
    elevation -= (0.4 + 0.04 * std::abs(i - 20)) * kDegree;
  }
  return {elevation_rad, 1024, 0.5, 100.0};
}

TEST(SensorModel, EveryPixelCentreProjectsToItsOwnPixel) {
  for (const SensorModel& sensor :
       {UnevenSensor(), UniformSensorModel(64, 1800, -52 * kDegree, 52 * kDegree, 0.5, 60.0)}) {
    for (int row = 0; row < sensor.Rows(); ++row) {
      for (int column = 0; column < sensor.Columns(); ++column) {
        const auto pixel = sensor.Project(7.0f * sensor.RayOf(row, column));
        ASSERT_TRUE(pixel.has_value());
        EXPECT_EQ(pixel->row, row);
        EXPECT_EQ(pixel->column, column);
      }
    }
  }
}

TEST(SensorModel, RaysAreUnitAndColumnsRunClockwiseFromTheRear) {
  const SensorModel sensor = UnevenSensor();
  EXPECT_NEAR(sensor.RayOf(3, 5).norm(), 1.0f, 1e-6f);
  EXPECT_LT(sensor.RayOf(20, 0).x(), 0.0f);
  EXPECT_GT(sensor.RayOf(20, 256).y(), 0.9f);  // a quarter turn on: left
  EXPECT_GT(sensor.RayOf(20, 512).x(), 0.9f);  // half a turn on: ahead
}

TEST(SensorModel, TheSeamBehindTheSensorIsAdjacent) {
  const SensorModel sensor = UnevenSensor();
  EXPECT_EQ(sensor.Project({-10.0f, 1e-3f, 0.0f})->column, 0);
  EXPECT_EQ(sensor.Project({-10.0f, -1e-3f, 0.0f})->column, 1023);
  EXPECT_EQ(sensor.Project({-10.0f, 0.0f, 0.0f})->column, 0);
  EXPECT_EQ(sensor.Project({-10.0f, -0.0f, 0.0f})->column, 0);
}

TEST(SensorModel, PointsAboveAndBelowTheBeamsAreOutOfView) {
  const SensorModel sensor = UniformSensorModel(16, 512, -15 * kDegree, 15 * kDegree, 0.5, 100.0);
  EXPECT_FALSE(sensor.Project({0.0f, 0.0f, 5.0f}));
  EXPECT_FALSE(sensor.Project({0.1f, 0.0f, -5.0f}));
  // Half a row beyond the outer beams still belongs to them.
  const auto ray = [](double el) {
    return Eigen::Vector3f(
        static_cast<float>(std::cos(el)), 0.0f, static_cast<float>(std::sin(el)));
  };
  EXPECT_EQ(sensor.Project(ray(15.9 * kDegree))->row, 0);
  EXPECT_FALSE(sensor.Project(ray(16.1 * kDegree)));
  EXPECT_EQ(sensor.Project(ray(-15.9 * kDegree))->row, 15);
}

}  // namespace
}  // namespace covsplat
