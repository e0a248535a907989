#include "covsplat/mapping/point_grid.hpp"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat::test {
namespace {

constexpr double kBlockM = 0.8;
constexpr int kLevels = 3;

class PointGridTest : public ::testing::Test {
 protected:
  PointGridTest() : points_(Scattered(400, 6.0, 1)) {
    const SE3 T_map_sensor(Eigen::Quaterniond::Identity(), {30.3, -20.1, 2.2});
    const std::vector<PosedPoints> scans = {{T_map_sensor, points_}};
    grid_.emplace(scans, sensor_, kBlockM, kLevels, pool_);
    const SE3 T_grid_sensor = grid_->FromMap() * T_map_sensor;
    offset_ = T_grid_sensor.Translation().cast<float>();
  }

  static std::vector<Eigen::Vector3f> Scattered(int count, double half_m, std::uint64_t seed) {
    Rng rng(seed);
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < count; ++i) {
      points.push_back(Eigen::Vector3d(rng.Uniform(-half_m, half_m),
                                       rng.Uniform(-half_m, half_m),
                                       rng.Uniform(-half_m, half_m))
                           .cast<float>());
    }
    return points;
  }

  ThreadPool pool_{2};
  const SensorModel sensor_ = UniformSensorModel(16, 256, -0.4, 0.4, 0.001, 100.0);
  std::vector<Eigen::Vector3f> points_;
  std::optional<PointGrid> grid_;
  Eigen::Vector3f offset_;
};

TEST_F(PointGridTest, FindsTheCellOfEveryMeasurement) {
  double count = 0.0;
  for (std::size_t b = 0; b < grid_->Blocks(); ++b) {
    for (const PointCell& cell : grid_->Cells(b)) {
      count += cell.moments.count;
      const Eigen::Vector3d mean = cell.moments.Mean() + grid_->Corner(b);
      const std::optional<PointGrid::Place> place = grid_->Find(mean.cast<float>());
      ASSERT_TRUE(place.has_value());
      EXPECT_EQ(place->block, b);
      EXPECT_EQ(place->code, cell.code);
    }
  }
  EXPECT_EQ(count, static_cast<double>(points_.size()));
}

TEST_F(PointGridTest, MeasurementsAreWithinHalfACellOfItsMiddle) {
  const double half_m = 0.5 * grid_->CellSize(grid_->Levels());
  for (std::size_t b = 0; b < grid_->Blocks(); ++b) {
    for (const PointCell& cell : grid_->Cells(b)) {
      const Eigen::Vector3d mean = cell.moments.Mean() + grid_->Corner(b);
      const Eigen::Vector3d apart = mean - grid_->MiddleOf(b, cell.code);
      EXPECT_LT(apart.lpNorm<Eigen::Infinity>(), half_m + 1e-5);
    }
  }
}

TEST_F(PointGridTest, ABoxReachesIntoTheBlocksOfItsCorners) {
  int found = 0;
  for (const Eigen::Vector3f& corner : Scattered(300, 9.0, 2)) {
    const Eigen::Vector3f from = corner + offset_;
    const Eigen::AlignedBox3f box(from, Eigen::Vector3f(from.array() + 0.5f));
    std::set<std::size_t> expected;  // blocks are larger than the box
    for (int c = 0; c < 8; ++c) {
      const auto kind = static_cast<Eigen::AlignedBox3f::CornerType>(c);
      if (const auto place = grid_->Find(box.corner(kind))) expected.insert(place->block);
    }
    std::multiset<std::size_t> blocks;
    grid_->ForBlocksIn(box, [&](std::size_t block) { blocks.insert(block); });
    EXPECT_TRUE(std::ranges::equal(blocks, expected));
    found += blocks.empty() ? 0 : 1;
  }
  EXPECT_GT(found, 20);
  EXPECT_LT(found, 280);
}

}  // namespace
}  // namespace covsplat::test
