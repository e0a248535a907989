#include "covsplat/mapping/spawn.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/mapping/gaussian_map.hpp"

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.01;

using Triple = std::array<float, 3>;
using Cell = std::array<int, 3>;

Triple TripleOf(const GaussianColumns<float>& table, std::size_t i) {
  return {table.Column(kMeanX)[i], table.Column(kMeanY)[i], table.Column(kMeanZ)[i]};
}

Eigen::Matrix3f AxesOf(const GaussianColumns<float>& table, std::size_t i) {
  return Eigen::Quaternionf(table.Column(kQuatW)[i],
                            table.Column(kQuatX)[i],
                            table.Column(kQuatY)[i],
                            table.Column(kQuatZ)[i])
      .toRotationMatrix();
}

double ScaleOf(const GaussianColumns<float>& table, std::size_t i, int axis) {
  return std::exp(static_cast<double>(table.Column(kLogScaleU + axis)[i]));
}

Cell CellOfPoint(const Eigen::Vector3f& p, double voxel_m) {
  const auto scaled = (p / static_cast<float>(voxel_m)).array().floor().cast<int>().eval();
  return {scaled[0], scaled[1], scaled[2]};
}

/// One measured point with a surface whose normal leans away from the ray by `lean_rad`.
Keyframe OnePoint(const Eigen::Vector3f& point,
                  const Eigen::Vector3f& sigma_m,
                  float lean_rad,
                  ThreadPool& pool) {
  const Eigen::Vector3f towards_sensor = -point.normalized();
  const Eigen::Vector3f across = towards_sensor.unitOrthogonal();
  const Eigen::Quaternionf rotation =
      Eigen::AngleAxisf(lean_rad, across) *
      Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), towards_sensor);
  TrackedScan tracked;
  tracked.points = {point};
  tracked.surface = {point};
  tracked.covariance = {{rotation.toRotationMatrix(), sigma_m}};
  tracked.squared_distance = {0.0f};
  return MakeKeyframe(tracked, ReducedSensor(), kMaxSurfaceDistance, pool);
}

/// A point on the middle ray of a row, so that it falls on its pixel's centre.
Eigen::Vector3f AlongTheBeam(double range_m) {
  return static_cast<float>(range_m) * ReducedSensor().RayOf(16, 256).normalized();
}

/// Spacing of the reduced sensor's beams, which is wider than that of its columns.
const double kBeamSpacing = 0.5 * std::numbers::pi / 31.0;

/// The keyframe's own pixels alone, as in the paper.
SpawnConfig FromPixels() {
  SpawnConfig config;
  config.patches.enabled = false;
  config.min_opacity = 0.1;
  return config;
}

SpawnConfig By(ScaleRule rule) {
  SpawnConfig config = FromPixels();
  config.scale_rule = rule;
  return config;
}

SpawnConfig WithoutSmoothing() {
  SpawnConfig config = FromPixels();
  config.smoothing_depth_m = 0.0;
  return config;
}

class SpawnGaussiansTest : public ::testing::Test {
 protected:
  SpawnedGaussians Spawn(const Keyframe& keyframe, const SpawnConfig& config = FromPixels()) {
    const PatchFit fit = FitPatches(keyframe, {}, sensor_, config, pool_);
    return SpawnGaussians(keyframe, fit, nullptr, {}, sensor_, config);
  }
  /// From pixels, into a map that has something there.
  SpawnedGaussians SpawnMore(const Keyframe& keyframe,
                             const RenderOutput* render,
                             const std::vector<Disc>& existing,
                             const SpawnConfig& config = FromPixels()) {
    return SpawnGaussians(keyframe, {}, render, existing, sensor_, config);
  }
  std::vector<Disc> Existing(const GaussianMap& map, const SE3& T_map_sensor) {
    return map.Near(T_map_sensor, sensor_.MaxRange()).discs;
  }
  Eigen::Vector2d ScalesAt(double range_m, const Eigen::Vector3f& sigma, ScaleRule rule) {
    const SpawnedGaussians spawned =
        Spawn(OnePoint(AlongTheBeam(range_m), sigma, 0.0f, pool_), By(rule));
    EXPECT_EQ(spawned.gaussians.Size(), 1u);
    return {ScaleOf(spawned.gaussians, 0, 0), ScaleOf(spawned.gaussians, 0, 1)};
  }

  const SensorModel sensor_ = ReducedSensor();
  ThreadPool pool_{2};
};

TEST_F(SpawnGaussiansTest, FillEveryVoxelOnceInAnEmptyMap) {
  const SpawnConfig config = WithoutSmoothing();
  const Keyframe keyframe = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  std::set<Cell> occupied;
  for (std::size_t i = 0; i < keyframe.point.Size(); ++i) {
    if (keyframe.surface.Pixels()[i] < 0) continue;
    const auto point = static_cast<std::size_t>(keyframe.point.Pixels()[i]);
    occupied.insert(CellOfPoint(keyframe.tracked.points[point], config.voxel_m));
  }
  const SpawnedGaussians spawned = Spawn(keyframe, config);
  std::set<Cell> covered;
  for (std::size_t i = 0; i < spawned.gaussians.Size(); ++i) {
    const Triple mean = TripleOf(spawned.gaussians, i);
    EXPECT_TRUE(covered.insert(CellOfPoint({mean[0], mean[1], mean[2]}, config.voxel_m)).second);
  }
  EXPECT_EQ(covered, occupied);
}

TEST_F(SpawnGaussiansTest, SitOnMeasuredPoints) {
  const Keyframe keyframe = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  std::set<Triple> measured;
  for (const Eigen::Vector3f& p : keyframe.tracked.points) measured.insert({p[0], p[1], p[2]});
  const SpawnedGaussians spawned = Spawn(keyframe, WithoutSmoothing());
  ASSERT_GT(spawned.gaussians.Size(), 1000u);
  for (std::size_t i = 0; i < spawned.gaussians.Size(); ++i) {
    EXPECT_EQ(measured.count(TripleOf(spawned.gaussians, i)), 1u);
  }
}

TEST_F(SpawnGaussiansTest, AverageAwayMostOfTheNoiseOfTheirMeasurements) {
  const Keyframe keyframe = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  const auto median_distance = [&](const SpawnConfig& config) {
    const GaussianColumns<float> table = Spawn(keyframe, config).gaussians;
    std::vector<double> distance;
    for (std::size_t i = 0; i < table.Size(); ++i) {
      const Triple m = TripleOf(table, i);
      const Eigen::Vector3d mean(m[0], m[1], m[2]);
      const Eigen::Vector3d ray = mean.normalized();
      const double cosine = std::abs(AxesOf(table, i).col(2).cast<double>().dot(ray));
      distance.push_back(cosine *
                         std::abs(Room().Cast(Eigen::Vector3d::Zero(), ray) - mean.norm()));
    }
    const auto middle = distance.begin() + static_cast<std::ptrdiff_t>(distance.size() / 2);
    std::nth_element(distance.begin(), middle, distance.end());
    return *middle;
  };
  EXPECT_LT(median_distance(FromPixels()), 0.6 * median_distance(WithoutSmoothing()));
}

TEST_F(SpawnGaussiansTest, CoverARoomOnceAndNotTwice) {
  GaussianMap map(std::move(MakeSplatEngine(Backend::kCpu, sensor_, {}, pool_).value()), pool_);
  const SE3 pose = MakePose(0.02, -0.03, 0.4, 1.0, -1.0, 0.2);
  const Keyframe first = StillKeyframe(Room(), sensor_, pose, kNoise, 1, pool_);
  const Keyframe again = StillKeyframe(Room(), sensor_, pose, kNoise, 2, pool_);
  const SpawnedGaussians all = Spawn(first);
  map.AddKeyframe(first, all);
  const RenderOutput render = map.Engine().Render(pose);
  const SpawnedGaussians more = SpawnMore(again, &render, Existing(map, pose));
  EXPECT_LT(more.gaussians.Size(), 0.05 * static_cast<double>(all.gaussians.Size()));
}

TEST_F(SpawnGaussiansTest, LeaveOccupiedVoxelsAloneHoweverBadlyTheyAreExplained) {
  const Keyframe keyframe = OnePoint({5.05f, 0.05f, 0.05f}, {0.3f, 0.3f, 0.01f}, 0.0f, pool_);
  SpawnConfig config = FromPixels();
  config.voxel_m = 0.2;
  const auto spawned_beside = [&](const Eigen::Vector3f& mean) {
    const std::vector<Disc> one = {{mean, {0, 0.1f, 0}, {0, 0, 0.1f}, 0.0f}};
    return SpawnMore(keyframe, nullptr, one, config).gaussians.Size();
  };
  EXPECT_EQ(spawned_beside({5.15f, 0.15f, 0.15f}), 0u);  // in its voxel
  EXPECT_EQ(spawned_beside({5.25f, 0.15f, 0.15f}), 1u);  // in the next
}

TEST_F(SpawnGaussiansTest, CoverWhatHasAppearedAndNothingElse) {
  GaussianMap map(std::move(MakeSplatEngine(Backend::kCpu, sensor_, {}, pool_).value()), pool_);
  const Keyframe before = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  const SpawnedGaussians all = Spawn(before);
  map.AddKeyframe(before, all);
  // A cupboard of 2 m x 2.5 m, 3 m in front of the sensor.
  const Box cupboard{{3, -1, -1.5}, {4, 1, 1}};
  RayScene furnished = Room();
  furnished.Add(cupboard);
  const Keyframe after = StillKeyframe(furnished, sensor_, SE3(), kNoise, 2, pool_);
  const RenderOutput render = map.Engine().Render(SE3());
  const SpawnedGaussians fresh = SpawnMore(after, &render, Existing(map, SE3()));
  std::size_t on_the_cupboard = 0;
  for (std::size_t i = 0; i < fresh.gaussians.Size(); ++i) {
    const Triple mean = TripleOf(fresh.gaussians, i);
    on_the_cupboard += std::abs(mean[0] - 3.0f) < 5 * kNoise && std::abs(mean[1]) < 1.0f;
  }
  EXPECT_GT(on_the_cupboard, 50u);  // of about 125 voxels, sampled every 15 cm
  EXPECT_LT(static_cast<double>(fresh.gaussians.Size() - on_the_cupboard),
            0.05 * static_cast<double>(all.gaussians.Size()));
}

TEST_F(SpawnGaussiansTest, LieInTheirSurfaceWithTheFrontToTheSensor) {
  const Keyframe keyframe = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  const SpawnedGaussians spawned = Spawn(keyframe);
  for (std::size_t i = 0; i < spawned.gaussians.Size(); ++i) {
    const Eigen::Matrix3f axes = AxesOf(spawned.gaussians, i);
    const Triple mean = TripleOf(spawned.gaussians, i);
    EXPECT_LE(axes.col(2).dot(Eigen::Vector3f(mean[0], mean[1], mean[2])), 1e-4f);
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3f::Identity()).norm(), 1e-5f);
    EXPECT_NEAR(axes.determinant(), 1.0f, 1e-5f);
  }
}

TEST_F(SpawnGaussiansTest, KeepTheAxesOfASurfaceThatIsGivenFromBehind) {
  Keyframe keyframe = OnePoint(AlongTheBeam(5.0), {0.3f, 0.1f, 0.01f}, 0.3f, pool_);
  Eigen::Matrix3f& axes = keyframe.tracked.covariance[0].axes;
  const Eigen::Matrix3f facing = axes;
  axes.rightCols<2>() *= -1.0f;
  const SpawnedGaussians spawned = Spawn(keyframe);
  ASSERT_EQ(spawned.gaussians.Size(), 1u);
  EXPECT_LT((AxesOf(spawned.gaussians, 0) - facing).norm(), 1e-5f);
}

TEST_F(SpawnGaussiansTest, HaveScalesWithinTheLimitsByEitherRule) {
  const Keyframe keyframe = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  for (const ScaleRule rule : {ScaleRule::kSpacing, ScaleRule::kPaper}) {
    SpawnConfig config = By(rule);
    config.min_scale_m = 0.1;
    config.max_scale_m = 0.15;
    const SpawnedGaussians spawned = Spawn(keyframe, config);
    for (std::size_t i = 0; i < spawned.gaussians.Size(); ++i) {
      for (const int axis : {0, 1}) {
        EXPECT_GE(ScaleOf(spawned.gaussians, i, axis), 0.1 * (1.0 - 1e-6));  // float logarithm
        EXPECT_LE(ScaleOf(spawned.gaussians, i, axis), 0.15 * (1.0 + 1e-6));
      }
    }
  }
}

TEST_F(SpawnGaussiansTest, ScaleByThePapersRule) {
  const Eigen::Vector3f sigma(0.3f, 0.2f, 0.01f);
  // kappa = 0.1; ranges below 1 m count as 1 m; limits are 0.02 m and 0.5 m.
  const auto scales = [&](double range_m) { return ScalesAt(range_m, sigma, ScaleRule::kPaper); };
  EXPECT_LT((scales(10.0) - Eigen::Vector2d(0.3, 0.2)).norm(), 1e-6);
  EXPECT_LT((scales(5.0) - Eigen::Vector2d(0.15, 0.1)).norm(), 1e-6);
  EXPECT_LT((scales(0.6) - Eigen::Vector2d(0.03, 0.02)).norm(), 1e-6);
  EXPECT_LT((scales(50.0) - Eigen::Vector2d(0.5, 0.5)).norm(), 1e-6);
}

TEST_F(SpawnGaussiansTest, ScaleBySpacingToHalfWayToTheNeighbours) {
  const Eigen::Vector3f wide(1.0f, 1.0f, 0.01f);
  const auto scales = [&](double range_m) { return ScalesAt(range_m, wide, ScaleRule::kSpacing); };
  // Near, voxels of 0.3 m are the spacing; farther out it is that of the beams.
  EXPECT_LT((scales(2.0) - Eigen::Vector2d::Constant(0.15)).norm(), 1e-6);
  EXPECT_LT((scales(8.0) - Eigen::Vector2d::Constant(0.5 * 8.0 * kBeamSpacing)).norm(), 1e-4);
  EXPECT_LT((scales(16.0) - Eigen::Vector2d::Constant(0.5 * 16.0 * kBeamSpacing)).norm(), 1e-4);
}

TEST_F(SpawnGaussiansTest, AreNoLargerThanTheirSurface) {
  const Eigen::Vector2d scales = ScalesAt(8.0, {0.4f, 0.04f, 0.01f}, ScaleRule::kSpacing);
  EXPECT_NEAR(scales[0], 0.5 * 8.0 * kBeamSpacing, 1e-4);
  EXPECT_NEAR(scales[1], 1.5 * 0.04, 1e-6);
}

TEST_F(SpawnGaussiansTest, AreAsOpaqueAsTheyAreCertain) {
  for (const float lean : {0.0f, 0.5f, 1.0f, 1.5f}) {
    for (const double range : {2.0, 20.0, 50.0}) {
      const Keyframe keyframe = OnePoint(AlongTheBeam(range), {0.3f, 0.3f, 0.01f}, lean, pool_);
      const SpawnedGaussians spawned = Spawn(keyframe);
      ASSERT_EQ(spawned.gaussians.Size(), 1u);
      const double u = PhysicalConfidence(range, std::cos(static_cast<double>(lean)), {});
      EXPECT_NEAR(spawned.signals[0].confidence, u, 1e-5);
      EXPECT_NEAR(OpacityOf(spawned.gaussians, 0), 0.1 + 0.8 * u, 1e-5);  // paper eq. 8
    }
  }
}

TEST_F(SpawnGaussiansTest, TakeFromTrackingWhatTheirModeLetsThem) {
  const Keyframe keyframe = OnePoint(AlongTheBeam(20.0), {0.5f, 0.5f, 0.01f}, 0.5f, pool_);
  const auto spawn = [&](SpawnMode mode) {
    SpawnConfig config = FromPixels();
    config.mode = mode;
    config.fixed_scale_m = 0.123;
    return Spawn(keyframe, config).gaussians;
  };
  const auto full = spawn(SpawnMode::kFull);
  const auto no_opacity = spawn(SpawnMode::kNoOpacity);
  const auto no_scale = spawn(SpawnMode::kNoRangeScale);
  const auto identity = spawn(SpawnMode::kIdentity);
  const double middle = 0.5 * (FromPixels().min_opacity + FromPixels().max_opacity);
  ASSERT_GT(std::abs(ScaleOf(full, 0, 0) - 0.123), 0.05);
  ASSERT_GT(std::abs(OpacityOf(full, 0) - middle), 0.05);
  EXPECT_EQ(AxesOf(no_opacity, 0), AxesOf(full, 0));
  EXPECT_EQ(ScaleOf(no_opacity, 0, 0), ScaleOf(full, 0, 0));
  EXPECT_NEAR(OpacityOf(no_opacity, 0), middle, 1e-6);
  EXPECT_EQ(AxesOf(no_scale, 0), AxesOf(full, 0));
  EXPECT_NEAR(ScaleOf(no_scale, 0, 0), 0.123, 1e-6);
  EXPECT_EQ(OpacityOf(no_scale, 0), OpacityOf(full, 0));
  EXPECT_NEAR(std::abs(AxesOf(identity, 0)(2, 2)), 1.0f, 1e-6f);
  EXPECT_NEAR(ScaleOf(identity, 0, 1), 0.123, 1e-6);
  EXPECT_NEAR(OpacityOf(identity, 0), middle, 1e-6);
}

TEST_F(SpawnGaussiansTest, CarryTheControlScoreOfTheirSurface) {
  Keyframe keyframe = OnePoint(AlongTheBeam(5.0), {0.3f, 0.3f, 0.01f}, 0.0f, pool_);
  EXPECT_TRUE(
      std::isnan(Spawn(keyframe).signals[0].control_score));  // one point is too few to know
  keyframe.control_score[0] = 0.25f;
  EXPECT_EQ(Spawn(keyframe).signals[0].control_score, 0.25f);
}

TEST_F(SpawnGaussiansTest, CarryTheIntensityOfTheirPixel) {
  Keyframe keyframe = OnePoint(AlongTheBeam(5.0), {0.3f, 0.3f, 0.01f}, 0.0f, pool_);
  EXPECT_EQ(Spawn(keyframe).signals[0].intensity, 0.0f);  // the scan has none
  keyframe.tracked.intensity = {42.0f};
  EXPECT_EQ(Spawn(keyframe).signals[0].intensity, 42.0f);
}

TEST_F(SpawnGaussiansTest, NeedAKnownSurface) {
  Keyframe keyframe = OnePoint(AlongTheBeam(5.0), {0.3f, 0.3f, 0.01f}, 0.0f, pool_);
  for (int& surface : keyframe.surface.Pixels()) surface = -1;
  EXPECT_EQ(Spawn(keyframe).gaussians.Size(), 0u);
}

// The rest is about patches.

/// A keyframe with the scans of two more poses near by.
Keyframe WithSweep(const RayScene& scene, const SensorModel& sensor, ThreadPool& pool) {
  Keyframe keyframe = StillKeyframe(scene, sensor, SE3(), kNoise, 1, pool);
  for (const double y : {-0.2, 0.2}) {
    const SE3 pose = MakePose(0.01, 0.02, 0.1, 0.1, y, 0.05);
    const auto seed = static_cast<std::uint64_t>(y > 0 ? 2 : 3);
    TrackedScan more = TrackedStill(scene, sensor, pose, kNoise, seed, pool);
    keyframe.tracked.sweep.push_back({pose, std::move(more.points)});
  }
  return keyframe;
}

TEST_F(SpawnGaussiansTest, OfPatchesLieCloserToTheSurfaceThanPixels) {
  const Keyframe keyframe = WithSweep(Room(), sensor_, pool_);
  const auto rim_error = [&](const SpawnConfig& config) {
    const SpawnedGaussians spawned = Spawn(keyframe, config);
    const GaussianColumns<float>& table = spawned.gaussians;
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < table.Size(); ++i) {
      if (config.patches.enabled && spawned.signals[i].density == 0.0f) continue;
      const Triple m = TripleOf(table, i);
      const Eigen::Vector3d rim =
          Eigen::Vector3f(Eigen::Vector3f(m[0], m[1], m[2]) +
                          static_cast<float>(ScaleOf(table, i, 0)) * AxesOf(table, i).col(0))
              .cast<double>();
      sum += std::abs(Room().Cast(Eigen::Vector3d::Zero(), rim.normalized()) - rim.norm());
      count += 1.0;
    }
    return sum / count;
  };
  EXPECT_LT(rim_error({}), 0.5 * rim_error(FromPixels()));
}

TEST_F(SpawnGaussiansTest, OfPatchesReplaceWhatWasMadeOfLess) {
  const Keyframe first = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  GaussianMap map(std::move(MakeSplatEngine(Backend::kCpu, sensor_, {}, pool_).value()), pool_);
  map.AddKeyframe(first, Spawn(first));
  const std::size_t before = map.Size();
  const PatchFit fit = FitPatches(
      WithSweep(Room(), sensor_, pool_), Existing(map, SE3()), sensor_, SpawnConfig{}, pool_);
  EXPECT_GT(static_cast<double>(fit.replaced.size()), 0.5 * static_cast<double>(before));
  EXPECT_LT(fit.replaced.back(), before);
}

TEST_F(SpawnGaussiansTest, FromPixelsFillTheGapsBetweenPatches) {
  const Keyframe keyframe = WithSweep(Room(), sensor_, pool_);
  PatchFit fit = FitPatches(keyframe, {}, sensor_, SpawnConfig{}, pool_);
  const auto spawned = [&] {
    return SpawnGaussians(keyframe, fit, nullptr, {}, sensor_, {}).gaussians.Size();
  };
  const std::size_t with_gaps = spawned();
  EXPECT_GT(with_gaps, fit.patches.size());
  std::fill(fit.covered.begin(), fit.covered.end(), 1);
  EXPECT_LE(spawned(), fit.patches.size());
}

TEST_F(SpawnGaussiansTest, OfPatchesAreNotWhereTheKeyframeSeesThrough) {
  // A cupboard stands in front of the sensor in the sweep and is gone in the keyframe.
  RayScene furnished = Room();
  furnished.Add(Box{{3, -1, -1.5}, {4, 1, 1}});
  Keyframe keyframe = StillKeyframe(Room(), sensor_, SE3(), kNoise, 1, pool_);
  keyframe.tracked.sweep.push_back(
      {SE3(), TrackedStill(furnished, sensor_, SE3(), kNoise, 2, pool_).points});
  const GaussianColumns<float> table = Spawn(keyframe, {}).gaussians;
  ASSERT_GT(table.Size(), 100u);
  for (std::size_t i = 0; i < table.Size(); ++i) {
    const Triple mean = TripleOf(table, i);
    EXPECT_FALSE(std::abs(mean[0] - 3.0f) < 0.1f && std::abs(mean[1]) < 0.9f && mean[2] < 0.9f &&
                 mean[2] > -1.0f)
        << mean[0] << " " << mean[1] << " " << mean[2];
  }
}

}  // namespace
}  // namespace covsplat::test
