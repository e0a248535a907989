#include <cmath>
#include <set>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/registration/symmetric_eigen.hpp"

namespace covsplat::test {
namespace {

TEST(DecomposeSymmetric, IsProperSortedAndExact) {
  Rng rng(1);
  for (int trial = 0; trial < 2000; ++trial) {
    Eigen::Matrix3d a;
    for (int k = 0; k < 9; ++k) a(k) = rng.Normal();
    Eigen::Vector3d scale(1.0, trial % 2 == 0 ? 1.0 : 0.1, trial % 3 == 0 ? 0.0 : 0.01);
    const Eigen::Matrix3d matrix = a * scale.asDiagonal() * a.transpose();
    const SymmetricEigen eigen = DecomposeSymmetric(matrix);
    EXPECT_GE(eigen.values[0], eigen.values[1]);
    EXPECT_GE(eigen.values[1], eigen.values[2]);
    EXPECT_NEAR(eigen.vectors.determinant(), 1.0, 1e-12);
    const Eigen::Matrix3d rebuilt =
        eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose();
    EXPECT_LT((rebuilt - matrix).norm(), 1e-13 * (1.0 + matrix.norm()));
  }
  for (const Eigen::Matrix3d& special : {Eigen::Matrix3d(Eigen::Matrix3d::Zero()),
                                         Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                                         Eigen::Matrix3d(Eigen::Matrix3d::Ones())}) {
    EXPECT_NEAR(DecomposeSymmetric(special).vectors.determinant(), 1.0, 1e-12);
  }
}

TEST(Preprocess, KeepsTheNumberOfPointsWithinItsLimits) {
  ThreadPool pool(2);
  const Scan scan = Simulate(Room(), SimulatedSensor(), HandheldWalk, 1.0, 0.02);
  const auto size = [&](int min_points, int max_points) {
    PreprocessConfig config;
    config.min_points = min_points;
    config.max_points = max_points;
    return Preprocess(scan, TimeScan(scan, {}), {}, config, pool).Size();
  };
  const std::size_t plain = size(0, 1000000);
  EXPECT_EQ(size(0, 1000), 1000u);
  const std::size_t finer = size(static_cast<int>(plain) + 1, 1000000);
  EXPECT_GT(finer, 2 * plain);  // of surfaces: four times as many, where there are enough points
  EXPECT_LE(size(1000000, 1000000), scan.points.size());
}

TEST(Preprocess, KeepsOneMeasuredPointPerVoxel) {
  ThreadPool pool(2);
  const Scan scan = Simulate(Room(), SimulatedSensor(), HandheldWalk, 1.0, 0.02);
  const ScanTiming timing = TimeScan(scan, DeskewConfig{});
  const SourceCloud cloud = Preprocess(scan, timing, ScanMotion{}, PreprocessConfig{}, pool);
  EXPECT_EQ(cloud.scan_points, scan.points.size());
  EXPECT_GT(cloud.Size(), 5000u);
  EXPECT_LT(cloud.Size(), 20000u);
  std::set<std::tuple<int, int, int>> voxels;
  for (std::size_t i = 0; i < cloud.Size(); ++i) {
    const auto index = static_cast<std::size_t>(cloud.scan_index[i]);
    EXPECT_EQ(cloud.points[i], scan.points[index]);
    EXPECT_EQ(cloud.phase[i], timing.phase[index]);
    const Eigen::Vector3i cell = CellOf(cloud.points[i] / 0.4f);
    EXPECT_TRUE(voxels.emplace(cell.x(), cell.y(), cell.z()).second);
  }
}

TEST(Preprocess, DropsAndCountsWhatCannotBeUsed) {
  ThreadPool pool(1);
  Scan scan;
  const float inf = std::numeric_limits<float>::infinity();
  scan.points = {
      {1, 1, 0}, {std::nanf(""), 0, 0}, {0.1f, 0, 0}, {0, inf, 0}, {500, 0, 0}, {0, 0, 0}};
  const SourceCloud cloud = Preprocess(scan, {}, {}, PreprocessConfig{}, pool);
  ASSERT_EQ(cloud.Size(), 1u);
  EXPECT_EQ(cloud.scan_index[0], 0);
  EXPECT_EQ(cloud.not_finite, 2u);
  EXPECT_EQ(cloud.out_of_range, 3u);
  EXPECT_TRUE(cloud.covariance[0].axes.allFinite());
  EXPECT_TRUE(cloud.covariance[0].sigma_m.allFinite());
  EXPECT_EQ(Preprocess(Scan{}, {}, {}, PreprocessConfig{}, pool).Size(), 0u);
}

TEST(Preprocess, DescribesSurfacesByProperFramesThatFaceTheSensor) {
  ThreadPool pool(2);
  const Scan scan = Simulate(Room(), SimulatedSensor(), HandheldWalk, 1.0, 0.02);
  ScanMotion motion;
  motion.twist << 0.05, -0.04, 0.1, 0.15, 0.02, -0.03;
  const SourceCloud cloud =
      Preprocess(scan, TimeScan(scan, DeskewConfig{}), motion, PreprocessConfig{}, pool);
  for (std::size_t i = 0; i < cloud.Size(); ++i) {
    const PointCovariance& c = cloud.covariance[i];
    EXPECT_NEAR(c.axes.determinant(), 1.0f, 1e-5f);
    EXPECT_LT((c.axes * c.axes.transpose() - Eigen::Matrix3f::Identity()).norm(), 1e-5f);
    EXPECT_GE(c.sigma_m[0], c.sigma_m[1]);
    EXPECT_GE(c.sigma_m[1], c.sigma_m[2]);
    EXPECT_GE(c.sigma_m[2], 0.0f);
    EXPECT_LT(c.axes.col(2).dot(cloud.points[i]), 1e-4f);
  }
}

// Share of points whose normal is within a few degrees of the nearest wall's.
TEST(Preprocess, FindsTheNormalsOfARoomUnderNoise) {
  ThreadPool pool(2);
  const SourceCloud cloud = StillCloud(Room(), SE3(), 0.02, 1, pool);
  std::vector<double> degrees;
  for (const PointCovariance& c : cloud.covariance) {
    const double along = static_cast<double>(c.axes.col(2).cwiseAbs().maxCoeff());
    degrees.push_back(std::acos(std::min(along, 1.0)) * 180.0 / M_PI);
  }
  std::sort(degrees.begin(), degrees.end());
  const auto at = [&](double share) {
    return degrees[static_cast<std::size_t>(share * static_cast<double>(degrees.size() - 1))];
  };
  std::printf("%zu points, normals: median %.2f deg, 75 %% %.2f, 90 %% %.2f\n",
              cloud.Size(),
              at(0.5),
              at(0.75),
              at(0.9));
  EXPECT_LT(at(0.5), 2.0);
}

}  // namespace
}  // namespace covsplat::test
