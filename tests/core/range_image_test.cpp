#include "covsplat/core/range_image.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

SensorModel Sensor() { return UniformSensorModel(16, 512, -0.25, 0.25, 1.0, 50.0); }

TEST(RangeImage, AnIdealScanFillsEveryPixelWithItsOwnBeam) {
  const SensorModel sensor = Sensor();
  std::vector<Eigen::Vector3f> points;
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      points.push_back((2.0f + 0.01f * static_cast<float>(row)) * sensor.RayOf(row, column));
    }
  }
  const RangeImage image = ProjectScan(sensor, points);
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    EXPECT_EQ(image.point_index.Pixels()[static_cast<std::size_t>(i)], i);
  }
}

TEST(RangeImage, NearestPointWinsAndTiesGoToTheLowerIndex) {
  const SensorModel sensor = Sensor();
  const Eigen::Vector3f ray = sensor.RayOf(4, 100);
  const std::vector<Eigen::Vector3f> points = {9.0f * ray, 3.0f * ray, 3.0f * ray, 5.0f * ray};
  const RangeImage image = ProjectScan(sensor, points);
  EXPECT_EQ(image.point_index(4, 100), 1);
  EXPECT_FLOAT_EQ(image.range_m(4, 100), points[1].norm());
}

TEST(RangeImage, InvalidPointsLeaveTheImageEmpty) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<Eigen::Vector3f> points = {{nan, 1.0f, 0.0f},
                                               {inf, 0.0f, 0.0f},
                                               {0.0f, 0.0f, 0.0f},
                                               {0.5f, 0.0f, 0.0f},
                                               {80.0f, 0.0f, 0.0f}};
  const RangeImage image = ProjectScan(Sensor(), points);
  for (const int index : image.point_index.Pixels()) EXPECT_EQ(index, -1);
}

}  // namespace
}  // namespace covsplat
