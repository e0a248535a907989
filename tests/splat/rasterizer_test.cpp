// Forward rendering against the slow twin, and its invariances.
#include "covsplat/splat/cpu/rasterizer.hpp"

#include <algorithm>
#include <numbers>

#include "tests/splat/brute_force.hpp"
#include "tests/splat/scenes.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;

SE3 SomePose(std::uint64_t seed) {
  Rng rng(seed);
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = rng.Uniform(-0.3, 0.3);
  return SE3::Exp(xi);
}

template <class S>
void Look(Rasterizer<S>& rasterizer, const GaussianColumns<S>& table, const SE3& T_map_anchor) {
  const AnchorRange range{0, 0, table.Size()};
  rasterizer.LookFrom(SE3(), table, {&range, 1}, {&T_map_anchor, 1});
}

void ExpectMatchesTwin(const RasterConfig& config,
                       const GaussianColumns<double>& table,
                       const SE3& T_map_anchor) {
  const SensorModel sensor = SmallSensor();
  ThreadPool pool(1);
  Rasterizer<double> rasterizer(sensor, config, pool);
  Look(rasterizer, table, T_map_anchor);
  rasterizer.Render();
  const TileImages<double>& images = rasterizer.Images();
  int covered = 0;
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const PixelSums twin = BlendPixel(sensor, config, table, T_map_anchor, row, column);
      const std::size_t pixel = PixelIndex(rasterizer.View(), row, column);
      covered += twin.transmittance < 0.5;
      ASSERT_NEAR(images.transmittance[pixel], twin.transmittance, 1e-9) << row << " " << column;
      ASSERT_NEAR(images.range_sum[pixel], twin.range_sum, 1e-8) << row << " " << column;
      ASSERT_NEAR(images.median[pixel], twin.median, 1e-8) << row << " " << column;
      ASSERT_NEAR(images.normal_x[pixel], twin.normal.x(), 1e-9) << row << " " << column;
      ASSERT_NEAR(images.normal_z[pixel], twin.normal.z(), 1e-9) << row << " " << column;
    }
  }
  EXPECT_GT(covered, 50);  // the scene tests something
}

TEST(Rasterizer, MatchesEveryGaussianOnEveryPixelAheadAndAcrossTheSeam) {
  for (const double azimuth : {0.0, 1.3, kPi, -kPi + 0.2}) {
    ExpectMatchesTwin({}, RandomGaussians<double>(80, azimuth, 7), SomePose(3));
  }
}

TEST(Rasterizer, MatchesTheTwinWithHugeNearAndOverheadGaussians) {
  GaussianColumns<double> table = RandomGaussians<double>(40, 0.4, 9);
  Rng rng(4);
  for (std::size_t i = 0; i < 20; ++i) {
    const Eigen::Vector3d mean(rng.Uniform(-1.5, 1.5), rng.Uniform(-1.5, 1.5), rng.Uniform(-2, 2));
    const Eigen::Quaterniond q =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -mean.normalized());
    SetGaussian(table, i, mean, q, rng.Uniform(0.3, 3.0), rng.Uniform(0.3, 3.0), 0.6);
  }
  ExpectMatchesTwin({}, table, SE3());
}

TEST(Rasterizer, TwoSidedDrawsBothFaces) {
  GaussianColumns<double> table = RandomGaussians<double>(60, 0.0, 11);
  for (std::size_t i = 0; i < table.Size(); i += 2) {  // turn every other one around
    const double w = table.Column(kQuatW)[i];
    const double x = table.Column(kQuatX)[i];
    const double y = table.Column(kQuatY)[i];
    const double z = table.Column(kQuatZ)[i];
    table.Column(kQuatW)[i] = -x;
    table.Column(kQuatX)[i] = w;
    table.Column(kQuatY)[i] = z;
    table.Column(kQuatZ)[i] = -y;
  }
  RasterConfig config;
  config.two_sided = true;
  ExpectMatchesTwin(config, table, SE3());
}

TEST(Rasterizer, ATiledWallHasTheWallsDepthAcrossTheSeam) {
  // A wall 5 m behind the sensor, straddling azimuth pi, tiled with overlapping surfels.
  const SensorModel sensor = UniformSensorModel(32, 512, -0.3, 0.3, 0.5, 30.0);
  GaussianColumns<float> table;
  const int side = 41;
  table.Resize(static_cast<std::size_t>(side * side));
  const Eigen::Quaterniond facing_x =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  for (int i = 0; i < side * side; ++i) {
    const Eigen::Vector3d mean(-5.0, 0.1 * (i % side - side / 2), 0.1 * (i / side - side / 2));
    SetGaussian(table, static_cast<std::size_t>(i), mean, facing_x, 0.1, 0.1, 0.9);
  }
  ThreadPool pool(2);
  RasterConfig config;
  config.alpha_min = 1.0 / 255.0;
  config.transmittance_min = 1e-4;
  Rasterizer<float> rasterizer(sensor, config, pool);
  Look(rasterizer, table, SE3());
  rasterizer.Render();
  for (const int column : {0, 1, 2, 30, 481, 510, 511}) {
    const std::size_t pixel = PixelIndex(rasterizer.View(), 16, column);
    const float alpha = 1.0f - rasterizer.Images().transmittance[pixel];
    const float truth = -5.0f / sensor.RayOf(16, column).x();
    EXPECT_GT(alpha, 0.98f);
    EXPECT_NEAR(rasterizer.Images().range_sum[pixel] / alpha, truth, 1e-4f * truth) << column;
    EXPECT_NEAR(rasterizer.Images().median[pixel], truth, 1e-4f * truth) << column;
  }
}

TEST(Rasterizer, TurningTheSceneByWholeColumnsRollsTheImage) {
  const SensorModel sensor = SmallSensor();
  const GaussianColumns<double> table = RandomGaussians<double>(60, 0.0, 21);
  ThreadPool pool(1);
  Rasterizer<double> rasterizer(sensor, {}, pool);
  Look(rasterizer, table, SE3());
  rasterizer.Render();
  const TileImages<double> straight = rasterizer.Images();
  const int shift = 29;
  const double angle = 2.0 * kPi * shift / sensor.Columns();
  const SE3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                   Eigen::Vector3d::Zero());
  Look(rasterizer, table, turned);
  rasterizer.Render();
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const int rolled = (column - shift + sensor.Columns()) % sensor.Columns();
      EXPECT_NEAR(rasterizer.Images().range_sum[PixelIndex(rasterizer.View(), row, rolled)],
                  straight.range_sum[PixelIndex(rasterizer.View(), row, column)],
                  1e-9);
    }
  }
}

TEST(Rasterizer, OrderInTheTableDoesNotMatter) {
  const SensorModel sensor = SmallSensor();
  const GaussianColumns<double> table = RandomGaussians<double>(64, 0.0, 5);
  GaussianColumns<double> reversed;
  reversed.Resize(64);
  for (int p = 0; p < kParameterCount; ++p) {
    std::reverse_copy(table.Column(p), table.Column(p) + 64, reversed.Column(p));
  }
  ThreadPool pool(1);
  Rasterizer<double> a(sensor, {}, pool);
  Rasterizer<double> b(sensor, {}, pool);
  Look(a, table, SE3());
  Look(b, reversed, SE3());
  a.Render();
  b.Render();
  EXPECT_EQ(a.Images().range_sum, b.Images().range_sum);
}

TEST(Rasterizer, FloatFollowsDouble) {
  const SensorModel sensor = SmallSensor();
  const GaussianColumns<float> table = RandomGaussians<float>(80, kPi, 7);
  ThreadPool pool(1);
  Rasterizer<float> single(sensor, {}, pool);
  Rasterizer<double> exact(sensor, {}, pool);
  Look(single, table, SE3());
  Look(exact, Convert<double>(table), SE3());
  single.Render();
  exact.Render();
  // A contribution at the cut or at the change of branch may flip; all other pixels agree.
  int different = 0;
  for (std::size_t i = 0; i < single.Images().range_sum.size(); ++i) {
    different += std::abs(static_cast<double>(single.Images().range_sum[i]) -
                          exact.Images().range_sum[i]) > 2e-4;
  }
  EXPECT_LE(different, 5);
}

TEST(Rasterizer, NothingToSeeIsTransparent) {
  ThreadPool pool(2);
  Rasterizer<float> rasterizer(SmallSensor(), {}, pool);
  GaussianColumns<float> empty;
  rasterizer.LookFrom(SE3(), empty, {}, {});
  rasterizer.Render();
  for (const float t : rasterizer.Images().transmittance) EXPECT_EQ(t, 1.0f);
}

TEST(Rasterizer, BrokenGaussiansAreNotDrawn) {
  ThreadPool pool(1);
  Rasterizer<float> rasterizer(SmallSensor(), {}, pool);
  Look(rasterizer, BrokenGaussians(), SE3());
  rasterizer.Render();
  for (const float t : rasterizer.Images().transmittance) {
    EXPECT_GE(t, 0.0f);
    EXPECT_LE(t, 1.0f);
  }
  for (const float r : rasterizer.Images().range_sum) EXPECT_TRUE(std::isfinite(r));
}

}  // namespace
}  // namespace covsplat
