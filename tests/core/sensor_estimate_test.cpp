#include "covsplat/core/sensor_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTableTolerance_rad = 0.05 * kDegree;

// What a sensor 1.7 m above the ground sees between two walls, column by column, with 2 cm of noise
// in range and a part of the returns lost.
Scan SimulatedScan(const SensorModel& sensor, std::uint64_t seed, double lost) {
  Rng rng(seed);
  Scan scan;
  for (int column = 0; column < sensor.Columns(); ++column) {
    for (int row = 0; row < sensor.Rows(); ++row) {
      const Eigen::Vector3f ray = sensor.RayOf(row, column);
      const float wall = 12.0f / std::max(std::abs(ray.y()), 0.15f);
      const float ground = ray.z() < 0.0f ? 1.7f / -ray.z() : wall;
      const auto noise = static_cast<float>(0.02 * rng.Normal());
      if (rng.Uniform() >= lost) scan.points.push_back((std::min(wall, ground) + noise) * ray);
    }
  }
  return scan;
}

std::vector<Scan> SimulatedScans(const SensorModel& sensor, double lost) {
  return {SimulatedScan(sensor, 1, lost), SimulatedScan(sensor, 2, lost)};
}

void ExpectSameTable(const SensorModel& found, const SensorModel& truth) {
  ASSERT_EQ(found.Rows(), truth.Rows());
  for (std::size_t row = 0; row < found.Elevations().size(); ++row) {
    EXPECT_NEAR(found.Elevations()[row], truth.Elevations()[row], kTableTolerance_rad) << row;
  }
}

TEST(SensorEstimate, FindsTheBeamsOfEvenSensors) {
  for (const int rows : {16, 32, 64, 128}) {
    const SensorModel truth =
        UniformSensorModel(rows, 1024, -22.5 * kDegree, 22.5 * kDegree, 0.5, 100.0);
    const SensorEstimate estimate = EstimateSensorModel(SimulatedScans(truth, 0.1), {});
    EXPECT_EQ(estimate.basis, RowBasis::kBeams) << estimate.verdict;
    ExpectSameTable(estimate.model, truth);
    EXPECT_EQ(estimate.model.Columns(), 1024) << estimate.verdict;
  }
}

TEST(SensorEstimate, FindsBeamsThatAreNotEvenlySpaced) {
  std::vector<double> elevations;
  for (int i = 0; i < 40; ++i) elevations.push_back((15.0 - 0.3 * i - 0.01 * i * i) * kDegree);
  const SensorModel truth(elevations, 800, 0.5, 100.0);
  const SensorEstimate estimate = EstimateSensorModel(SimulatedScans(truth, 0.2), {});
  ExpectSameTable(estimate.model, truth);
  EXPECT_NEAR(estimate.model.Columns(), 800, 4);
}

TEST(SensorEstimate, FindsOverlappingBeamsThatAreStoredOneByOne) {
  const SensorModel truth = UniformSensorModel(64, 900, -20 * kDegree, 5 * kDegree, 0.5, 100.0);
  Scan scan;
  Rng rng(3);
  for (int row = 0; row < truth.Rows(); ++row) {
    for (int column = 0; column < truth.Columns(); ++column) {
      const float range = static_cast<float>(rng.Uniform(3.0, 60.0));
      scan.points.push_back(range * truth.RayOf(row, column) + Eigen::Vector3f(0, 0, 0.1f));
    }
  }
  const SensorEstimate estimate = EstimateSensorModel({{scan}}, {});
  ASSERT_EQ(estimate.model.Rows(), 64) << estimate.verdict;
  for (std::size_t row = 0; row < 64; ++row) {
    EXPECT_NEAR(estimate.model.Elevations()[row], truth.Elevations()[row], 0.2 * kDegree);
  }
}

TEST(SensorEstimate, PointsThatAreNoMeasurementsDoNotCount) {
  const SensorModel truth = UniformSensorModel(32, 512, -16 * kDegree, 15 * kDegree, 0.5, 100.0);
  std::vector<Scan> scans = SimulatedScans(truth, 0.1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < scans[0].points.size(); i += 3) {
    scans[0].points[i] = i % 2 == 0 ? Eigen::Vector3f(nan, nan, nan) : Eigen::Vector3f::Zero();
  }
  scans[1].points.emplace_back(inf, 0.0f, 0.0f);
  scans.emplace_back();
  const SensorEstimate estimate = EstimateSensorModel(scans, {});
  ExpectSameTable(estimate.model, truth);
  EXPECT_EQ(estimate.model.Columns(), 512);
  EXPECT_GT(estimate.model.MinRange(), 0.5);
  EXPECT_LT(estimate.model.MaxRange(), 110.0);
}

TEST(SensorEstimate, ScatteredPointsGetPixelsOfTheirDensity) {
  Rng rng(4);
  Scan scan;
  while (scan.points.size() < 5000) {  // a round view of 70 degrees
    const double azimuth = rng.Uniform(-35.0, 35.0);
    const double elevation = rng.Uniform(-35.0, 35.0);
    if (std::hypot(azimuth, elevation) > 35.0) continue;
    const double range = rng.Uniform(2.0, 30.0);
    scan.points.push_back((range * Eigen::Vector3d(std::cos(azimuth * kDegree),
                                                   std::sin(azimuth * kDegree),
                                                   std::tan(elevation * kDegree)))
                              .cast<float>());
  }
  const SensorEstimate estimate = EstimateSensorModel({{scan}}, {});
  EXPECT_EQ(estimate.basis, RowBasis::kUniform) << estimate.verdict;
  const double in_view = estimate.model.Rows() * estimate.model.Columns() * (70.0 / 360.0) * 0.785;
  EXPECT_NEAR(in_view / 5000.0, 1.0, 0.15) << estimate.verdict;
}

TEST(SensorEstimate, WithoutAnyPointsItSaysThatItAssumes) {
  const SensorEstimate estimate = EstimateSensorModel({}, {});
  EXPECT_EQ(estimate.basis, RowBasis::kAssumed);
  EXPECT_NE(estimate.verdict.find("assumed"), std::string::npos);
}

TEST(SensorEstimate, OnePointIsEnoughForAValidModel) {
  Scan scan;
  scan.points.emplace_back(0.0f, 0.0f, 5.0f);
  const SensorEstimate estimate = EstimateSensorModel({{scan}}, {});
  EXPECT_EQ(estimate.basis, RowBasis::kUniform);
  EXPECT_GE(estimate.model.Rows(), 8);
}

}  // namespace
}  // namespace covsplat
