#include "covsplat/mapping/patches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"
#include "covsplat/mapping/keyframe.hpp"

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.01;

/// Points scattered over a function's graph x = f(y, z), with noise along x, seen from the origin.
template <class F>
SweptScan Sample(F&& x_of, int count, double half_m, double noise_m, std::uint64_t seed) {
  Rng rng(seed);
  SweptScan scan;
  for (int i = 0; i < count; ++i) {
    const double y = half_m * (2.0 * rng.Uniform() - 1.0);
    const double z = half_m * (2.0 * rng.Uniform() - 1.0);
    const double x = x_of(y, z) + noise_m * rng.Normal();
    scan.points.push_back(Eigen::Vector3d(x, y, z).cast<float>());
  }
  return scan;
}

SweptScan Wall(int count, std::uint64_t seed) {
  return Sample([](double, double) { return 5.2; }, count, 2.0, kNoise, seed);
}

std::vector<PosedPoints> Views(const std::vector<SweptScan>& scans) {
  std::vector<PosedPoints> views;
  for (const SweptScan& scan : scans) {
    views.push_back({scan.T_odom_sensor, scan.points, scan.intensity});
  }
  return views;
}

class PatchesTest : public ::testing::Test {
 protected:
  PatchFit Fit(const std::vector<SweptScan>& scans,
               const std::vector<Disc>& known = {},
               const PatchConfig& config = {}) {
    return FitPatches(Views(scans), known, sensor_, config, pool_);
  }
  std::vector<Disc> DiscsOf(const PatchFit& fit, const PatchConfig& config = {}) {
    std::vector<Disc> discs;
    const auto factor = static_cast<float>(config.extent_factor);
    for (const Patch& patch : fit.patches) {
      discs.push_back({patch.mean,
                       factor * patch.sigma_m[0] * patch.axes.col(0),
                       factor * patch.sigma_m[1] * patch.axes.col(1),
                       patch.density});
    }
    return discs;
  }

  const SensorModel sensor_ = UniformSensorModel(32, 512, -0.25 * M_PI, 0.25 * M_PI, 0.5, 60.0);
  ThreadPool pool_{2};
};

TEST_F(PatchesTest, OfAFlatWallAreAsLargeAsTheirCells) {
  const PatchFit fit = Fit({Wall(20000, 1)});
  // 4 m x 4 m in cells of 0.8 m: 5 x 5, or one more row and column where they are cut.
  EXPECT_GE(fit.patches.size(), 25u);
  EXPECT_LE(fit.patches.size(), 36u);
  for (const Patch& patch : fit.patches) {
    EXPECT_NEAR(patch.mean.x(), 5.2, 2e-3);
    EXPECT_LT(patch.axes.col(2).x(), -0.999f);  // towards the sensor
    EXPECT_NEAR(patch.axes.determinant(), 1.0f, 1e-5f);
    EXPECT_NEAR(patch.sigma_m[2], kNoise, 2e-3);
    EXPECT_LE(patch.sigma_m[0], 0.8 / std::sqrt(12.0) + 0.01);
  }
  EXPECT_TRUE(
      std::all_of(fit.covered.begin(), fit.covered.end(), [](auto covered) { return covered; }));
}

TEST_F(PatchesTest, KnowTheDensityOfTheirMeasurements) {
  for (const Patch& patch : Fit({Wall(20000, 1)}).patches) {
    if (patch.sigma_m[1] < 0.2f) continue;  // cut by the wall's edge
    EXPECT_NEAR(patch.density, 20000.0 / 16.0, 200.0);
  }
}

TEST_F(PatchesTest, CarryTheMeanIntensityOfTheirMeasurements) {
  SweptScan scan = Wall(20000, 1);
  for (const Eigen::Vector3f& p : scan.points) {
    scan.intensity.push_back(p.y() > 0.8f ? 50.0f : 10.0f + (scan.intensity.size() % 2 == 0));
  }
  for (const Patch& patch : Fit({scan}).patches) {
    const bool is_bright = patch.mean.y() > 0.8f;  // the edge of a cell
    EXPECT_NEAR(patch.intensity, is_bright ? 50.0f : 10.5f, 0.25f);
  }
  for (const Patch& patch : Fit({Wall(20000, 1)}).patches) EXPECT_EQ(patch.intensity, 0.0f);
}

TEST_F(PatchesTest, AreFinerWhereTheSurfaceBends) {
  const auto waves = [](double y, double) { return 5.2 + 0.3 * std::sin(3.0 * y); };
  const PatchFit bent = Fit({Sample(waves, 40000, 2.0, 0.002, 1)});
  EXPECT_GT(bent.patches.size(), 3 * Fit({Wall(40000, 1)}).patches.size());
  for (const Patch& patch : bent.patches) {
    const Eigen::Vector3d mean = patch.mean.cast<double>();
    EXPECT_NEAR(mean.x(), waves(mean.y(), mean.z()), 0.03);
  }
}

TEST_F(PatchesTest, AreNotMadeFinerByNoise) {
  const auto wall = [](double, double) { return 5.31; };
  const std::size_t exact = Fit({Sample(wall, 40000, 2.0, 0.001, 1)}).patches.size();
  const std::size_t noisy = Fit({Sample(wall, 40000, 2.0, 0.04, 1)}).patches.size();
  EXPECT_LE(noisy, exact + exact / 2);
}

TEST_F(PatchesTest, FollowAStepWithinACell) {
  const auto step = [](double y, double) { return y < 0.13 ? 5.1 : 5.35; };
  const PatchFit fit = Fit({Sample(step, 40000, 2.0, 0.005, 1)});
  std::size_t off = 0;
  for (const Patch& patch : fit.patches) {
    const double distance =
        std::min(std::abs(patch.mean.x() - 5.1f), std::abs(patch.mean.x() - 5.35f));
    off += distance > 0.02 ? 1 : 0;
  }
  EXPECT_LT(static_cast<double>(off), 0.05 * static_cast<double>(fit.patches.size()));
}

TEST_F(PatchesTest, AreNotSpawnedTwice) {
  const PatchFit first = Fit({Wall(20000, 1)});
  const PatchFit again = Fit({Wall(20000, 2)}, DiscsOf(first));
  EXPECT_TRUE(again.patches.empty());
  EXPECT_TRUE(again.replaced.empty());
  // Discs are taken to end a little within their edges.
  EXPECT_GT(std::count(again.covered.begin(), again.covered.end(), 1), 19000);
}

TEST_F(PatchesTest, LeaveSparseMeasurementsUncoveredHoweverNear) {
  // One cell of 0.8 m: dense in one half, two measurements in the other, off its plane.
  SweptScan scan;
  Rng rng(1);
  for (int i = 0; i < 300; ++i) {
    scan.points.push_back(
        Eigen::Vector3d(5.2, 0.05 + 0.3 * rng.Uniform(), 0.7 * rng.Uniform() + 0.05).cast<float>());
  }
  scan.points.emplace_back(5.5f, 0.6f, 0.2f);
  scan.points.emplace_back(5.5f, 0.7f, 0.6f);
  const PatchFit fit = Fit({scan});
  EXPECT_FALSE(fit.patches.empty());
  EXPECT_EQ(fit.covered.front(), 1);
  EXPECT_EQ(fit.covered[300], 0);
  EXPECT_EQ(fit.covered[301], 0);
}

TEST_F(PatchesTest, DoNotCoverWhatOnlyReplacedDiscsCovered) {
  // A large disc reaches beyond the dense patch that replaces it.
  SweptScan scan;
  Rng rng(1);
  for (int i = 0; i < 3000; ++i) {
    scan.points.push_back(
        Eigen::Vector3d(5.2, 0.02 + 0.36 * rng.Uniform(), 0.02 + 0.36 * rng.Uniform())
            .cast<float>());
  }
  scan.points.emplace_back(5.2f, 1.0f, 0.2f);
  const auto disc = [](float y, float density) {
    return Disc{{5.2f, y, 0.2f}, {0, 0.8f, 0}, {0, 0, 0.3f}, density};
  };
  EXPECT_EQ(Fit({scan}, {disc(0.2f, 1.0f)}).covered.back(), 0);  // sparse: it goes
  EXPECT_EQ(Fit({scan}, {disc(0.9f, 1.0f)}).covered.back(), 1);  // its middle is elsewhere
}

TEST_F(PatchesTest, ReplaceThoseOfFarFewerMeasurements) {
  const PatchFit sparse = Fit({Wall(2000, 1)});
  const PatchFit dense = Fit({Wall(20000, 2)}, DiscsOf(sparse));
  EXPECT_GE(dense.patches.size(), 25u);
  EXPECT_EQ(dense.replaced.size(), sparse.patches.size());
}

TEST_F(PatchesTest, GatherScansFromAllPoses) {
  std::vector<SweptScan> scans = {Wall(20, 1)};  // too few for most cells
  for (int i = 1; i <= 20; ++i) {
    SweptScan scan = Wall(1000, static_cast<std::uint64_t>(i));
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitZ()));
    scan.T_odom_sensor = SE3(turn, {0.01 * i, 0.0, 0.0});
    for (Eigen::Vector3f& p : scan.points) {
      p = (scan.T_odom_sensor.Inverse() * p.cast<double>()).cast<float>();
    }
    scans.push_back(std::move(scan));
  }
  const SE3 T_sensor_map = scans.back().T_odom_sensor.Inverse();
  const Eigen::Vector3d normal = T_sensor_map.Rotation() * -Eigen::Vector3d::UnitX();
  const PatchFit fit = Fit(scans);
  EXPECT_GE(fit.patches.size(), 25u);
  for (const Patch& patch : fit.patches) {  // in the frame of the last scan
    EXPECT_GT(patch.axes.col(2).dot(normal.cast<float>()), 0.999f);
    EXPECT_NEAR((scans.back().T_odom_sensor * patch.mean.cast<double>()).x(), 5.2, 5e-3);
  }
}

TEST_F(PatchesTest, AreTheSameFarFromTheOriginAndForAnyNumberOfThreads) {
  const SE3 far(Eigen::Quaterniond::Identity(), {8000.0, -4000.0, 80.0});  // whole cells away
  SweptScan moved = Wall(20000, 1);
  moved.T_odom_sensor = far;
  const PatchFit near_fit = Fit({Wall(20000, 1)});
  const PatchFit far_fit = Fit({moved});
  ThreadPool one(1);
  const PatchFit alone = FitPatches(Views({moved}), {}, sensor_, {}, one);
  ASSERT_EQ(far_fit.patches.size(), near_fit.patches.size());
  ASSERT_EQ(alone.patches.size(), far_fit.patches.size());
  for (std::size_t i = 0; i < far_fit.patches.size(); ++i) {
    EXPECT_LT((far_fit.patches[i].mean - near_fit.patches[i].mean).norm(), 1e-5f);
    EXPECT_EQ(alone.patches[i].mean, far_fit.patches[i].mean);
    EXPECT_EQ(alone.patches[i].axes, far_fit.patches[i].axes);
  }
}

TEST_F(PatchesTest, LeaveOutWhatIsNoMeasurement) {
  SweptScan scan = Wall(20000, 1);
  const std::size_t patches = Fit({scan}).patches.size();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 100; ++i) {
    const auto y = 0.001f * static_cast<float>(i);
    scan.points.push_back({nan, y, 0.0f});
    scan.points.push_back({0.1f, y, 0.05f});   // nearer than the sensor sees
    scan.points.push_back({80.0f, y, 0.05f});  // farther
  }
  const PatchFit fit = Fit({scan});
  EXPECT_EQ(fit.patches.size(), patches);
  EXPECT_EQ(fit.covered.size(), scan.points.size());
  EXPECT_EQ(fit.covered.back(), 0);
}

TEST_F(PatchesTest, DoNotTakeForeverOverAGiantDisc) {
  const Disc giant = {{5.2f, 0.0f, 0.0f}, {0.0f, 1e8f, 0.0f}, {0.0f, 0.0f, 1e8f}, 1e9f};
  EXPECT_TRUE(Fit({Wall(20000, 1)}, {giant}).patches.empty());
}

TEST_F(PatchesTest, OfNothingAreNone) {
  EXPECT_TRUE(Fit({}).patches.empty());
  EXPECT_TRUE(Fit({SweptScan{}}).patches.empty());
  EXPECT_TRUE(Fit({Wall(3, 1)}).patches.empty());
  // A line has no normal.
  SweptScan line;
  for (int i = 0; i < 1000; ++i)
    line.points.push_back({5.2f, 0.004f * static_cast<float>(i), 0.0f});
  EXPECT_TRUE(Fit({line}).patches.empty());
}

}  // namespace
}  // namespace covsplat::test
