#include "covsplat/mapping/point_grid.hpp"

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

TEST_F(PointGridTest, AFinderGoesWhereFindGoesAndIsSilentWithinACell) {
  PointGrid::Finder finder(*grid_);
  const Eigen::Vector3f first = points_[0] + offset_;
  const Eigen::Vector3f step = 0.013f * (points_[1] - points_[0]).normalized();
  std::optional<PointGrid::Place> before;
  int found = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3f p = first + static_cast<float>(i) * step;
    const std::optional<PointGrid::Place> place = grid_->Find(p);
    const std::optional<PointGrid::Place> fresh = finder.FindNew(p);
    const bool moved =
        place && (!before || before->block != place->block || before->code != place->code);
    EXPECT_EQ(fresh.has_value(), moved);
    if (fresh) {
      EXPECT_EQ(fresh->block, place->block);
      EXPECT_EQ(fresh->code, place->code);
      ++found;
    }
    before = place;
  }
  EXPECT_GT(found, 5);
}

TEST_F(PointGridTest, ABoxHoldsSomethingIfABlockThatItReachesIntoDoes) {
  int holding = 0;
  for (const Eigen::Vector3f& corner : Scattered(300, 9.0, 2)) {
    const Eigen::Vector3f from = corner + offset_;
    const Eigen::AlignedBox3f box(from, Eigen::Vector3f(from.array() + 0.5f));
    bool expected = false;  // blocks are larger than the box, so its corners are in all of them
    for (int c = 0; c < 8; ++c) {
      const auto kind = static_cast<Eigen::AlignedBox3f::CornerType>(c);
      expected |= grid_->Find(box.corner(kind)).has_value();
    }
    EXPECT_EQ(grid_->HoldsAnyIn(box), expected);
    holding += expected ? 1 : 0;
  }
  EXPECT_GT(holding, 20);
  EXPECT_LT(holding, 280);
}

TEST_F(PointGridTest, WithinACellNoStepOfTheMarginLeavesIt) {
  const Eigen::Vector3f margin(0.01f, 0.02f, 0.0f);
  int within = 0;
  for (const Eigen::Vector3f& p : points_) {
    const Eigen::Vector3f middle = p + offset_;
    const std::optional<PointGrid::Place> place = grid_->Find(middle);
    ASSERT_TRUE(place.has_value());
    bool same = true;
    for (const float x : {-1.0f, 1.0f}) {
      for (const float y : {-1.0f, 1.0f}) {
        const Eigen::Vector3f beside = middle + margin.cwiseProduct(Eigen::Vector3f(x, y, 0.0f));
        const std::optional<PointGrid::Place> other = grid_->Find(beside);
        same = same && other && other->block == place->block && other->code == place->code;
      }
    }
    EXPECT_EQ(grid_->IsWithinCell(middle, margin), same);
    within += same ? 1 : 0;
  }
  EXPECT_GT(within, 50);  // (1 - 2 * 0.1) * (1 - 2 * 0.2) of 400, give or take
  EXPECT_LT(within, 350);
}

}  // namespace
}  // namespace covsplat::test
