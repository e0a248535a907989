#include "covsplat/mapping/manage.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "tests/splat/scenes.hpp"
#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kReach = 50.0;
constexpr double kExtentFactor = 1.2;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// A wall across x, 1.6 m x 1.6 m, of squares with sides of 0.1 m.
SpawnedGaussians Wall(float control_score, double opacity = 0.8, double distance_m = 5.0) {
  constexpr int kSide = 16;
  const Eigen::Quaterniond facing(Eigen::AngleAxisd(-0.5 * M_PI, Eigen::Vector3d::UnitY()));
  const double scale_m = kExtentFactor * 0.1 / std::sqrt(12.0);
  SpawnedGaussians wall;
  wall.gaussians.Resize(std::size_t{kSide} * kSide);
  for (int i = 0; i < kSide * kSide; ++i) {
    const int column = i % kSide;
    const int row = i / kSide;
    const Eigen::Vector3d mean(distance_m, 0.1 * column - 0.75, 0.1 * row - 0.75);
    SetGaussian(
        wall.gaussians, static_cast<std::size_t>(i), mean, facing, scale_m, scale_m, opacity);
    wall.signals.push_back({.confidence = 0.5f,
                            .control_score = control_score,
                            .density = 1000.0f,
                            .intensity = 7.0f});
  }
  return wall;
}

class ManageMapTest : public ::testing::Test {
 protected:
  void Add(const SpawnedGaussians& spawned) {
    map_.AddKeyframe(SphereKeyframe(pose_, 0.0f), spawned);
  }
  void Manage(const ManageConfig& config) {
    const int first_keyframe = map_.Keyframes() - config.interval;
    ManageMap(map_, pose_, kReach, first_keyframe, kExtentFactor, config);
  }
  RenderOutput Render() { return map_.Engine().Render(pose_); }
  struct Means {
    double range_m = 0.0;
    double alpha = 0.0;
    int pixels = 0;
  };
  /// Of a rendering, where both show something.
  static Means MeansWhere(const RenderOutput& shown, const RenderOutput& other) {
    Means means;
    for (std::size_t i = 0; i < shown.alpha.Size(); ++i) {
      if (std::min(shown.alpha.Pixels()[i], other.alpha.Pixels()[i]) < 0.2f) continue;
      means.alpha += static_cast<double>(shown.alpha.Pixels()[i]);
      means.range_m += static_cast<double>(shown.range_m.Pixels()[i]);
      ++means.pixels;
    }
    means.alpha /= means.pixels;
    means.range_m /= means.pixels;
    return means;
  }
  static ManageConfig In(ManageMode mode) {
    ManageConfig config;
    config.mode = mode;
    config.plane.max_share = 1.0;
    config.plane.fill = 0.9;
    return config;
  }

  ThreadPool pool_{2};
  const SE3 pose_ = MakePose(0, 0, 0.7, 100, -40, 1);
  GaussianMap map_{std::move(MakeSplatEngine(Backend::kCpu, ReducedSensor(), {}, pool_).value()),
                   pool_};
};

TEST_F(ManageMapTest, CoversPlanesThatLookTheSameAfterwards) {
  // So near and so fine that pixels are smaller than Gaussians.
  const SensorModel fine = UniformSensorModel(256, 2048, -0.25 * M_PI, 0.25 * M_PI, 0.5, 60.0);
  map_ = GaussianMap(std::move(MakeSplatEngine(Backend::kCpu, fine, {}, pool_).value()), pool_);
  SpawnedGaussians wall = Wall(0.1f, 0.8, 2.0);
  const int keyframe = map_.Engine().AddAnchor(pose_);
  for (GaussianSignals& signals : wall.signals) signals.trackable = true;
  map_.Append(keyframe, wall);
  const RenderOutput before = Render();
  Manage(In(ManageMode::kPlane));
  EXPECT_LT(map_.Size(), 16u * 16u / 4u);
  const RenderOutput after = Render();
  const Means was = MeansWhere(before, after);
  const Means is = MeansWhere(after, before);
  EXPECT_GT(is.pixels, 8000);
  EXPECT_NEAR(is.range_m, was.range_m, 1e-3);
  EXPECT_NEAR(is.alpha, was.alpha, 0.05);
  for (const AnchorRange& range : map_.Engine().Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const GaussianSignals& signals = map_.Signals()[i];
      EXPECT_NEAR(signals.confidence, 0.5f, 1e-5f);
      EXPECT_NEAR(signals.control_score, 0.1f, 1e-5f);
      EXPECT_NEAR(signals.density, 1000.0f, 60.0f);
      EXPECT_NEAR(signals.intensity, 7.0f, 1e-4f);
      EXPECT_TRUE(signals.trackable);
    }
  }
}

TEST_F(ManageMapTest, DoesWhatItsModeSays) {
  const auto size_after = [&](ManageMode mode) {
    map_ = GaussianMap(
        std::move(MakeSplatEngine(Backend::kCpu, ReducedSensor(), {}, pool_).value()), pool_);
    Add(Wall(0.1f));
    ManageConfig config = In(mode);
    config.split.control_quantile = 0.0;
    config.split.min_scale_m = 0.01;
    config.split.max_share = 0.125;
    Manage(config);
    return map_.Size();
  };
  EXPECT_EQ(size_after(ManageMode::kOpacity), 256u);
  EXPECT_EQ(size_after(ManageMode::kSplit), 256u + 32u);
  const std::size_t covered = size_after(ManageMode::kPlane);
  EXPECT_LT(covered, 64u);
  EXPECT_EQ(size_after(ManageMode::kFull), covered + std::max<std::size_t>(1, covered / 8));
}

TEST_F(ManageMapTest, LeavesComplexUnknownAndTransparentGaussiansAlone) {
  Add(Wall(0.1f));
  Add(Wall(0.9f, 0.8, 8.0));
  Add(Wall(kUnknown, 0.8, 11.0));
  Add(Wall(0.1f, 0.2, 14.0));
  ManageConfig config = In(ManageMode::kPlane);
  config.plane.control_quantile = 0.5;
  Manage(config);
  EXPECT_LT(map_.Size(), 3u * 256u + 64u);
  EXPECT_GT(map_.Size(), 3u * 256u);
  config.feature_aware = false;  // then the score does not count
  Manage(config);
  EXPECT_LT(map_.Size(), 256u + 3u * 64u);
}

TEST_F(ManageMapTest, CoversAPlaneOnceAndLeavesItThenToNewGaussians) {
  Add(Wall(0.1f));
  ManageConfig config = In(ManageMode::kPlane);
  config.interval = 1;
  Manage(config);
  const std::size_t covered = map_.Size();
  Add({});
  Manage(config);
  EXPECT_EQ(map_.Size(), covered) << "nothing new";
  Add(Wall(0.1f));  // the same again, upon what is there
  Manage(config);
  EXPECT_LE(map_.Size(), covered + covered / 4);
}

TEST_F(ManageMapTest, JoinsTheSurfacesOfTwoPassesOnceTheyLieUponEachOther) {
  ManageConfig config = In(ManageMode::kPlane);
  config.interval = 1;
  Add(Wall(0.1f));
  Manage(config);
  const std::size_t covered = map_.Size();
  const SE3 drifted = pose_ * MakePose(0, 0, 0, 0.3, 0, 0);
  map_.AddKeyframe(SphereKeyframe(drifted, 0.0f), Wall(0.1f));
  Manage(config);
  ASSERT_GE(map_.Size(), 2 * covered - covered / 4) << "a double wall";
  const SE3 nearly = pose_ * MakePose(0, 0, 0, 0.01, 0, 0);
  map_.Engine().SetAnchorPose(1, nearly);
  map_.AddKeyframe(SphereKeyframe(pose_, 0.0f), {});
  Manage(config);
  ASSERT_GE(map_.Size(), 2 * covered - covered / 4) << "neither is new";
  JoinSurfaces(map_, pose_, kReach, kExtentFactor, config);
  EXPECT_LE(map_.Size(), covered + covered / 4);
}

TEST_F(ManageMapTest, KeepsCoversInTheNewestKeyframeOfTheirMembers) {
  SpawnedGaussians left = Wall(0.1f);
  Add(left);
  map_.AddKeyframe(SphereKeyframe(pose_ * MakePose(0, 0, 0.1, 0, 1.6, 0), 0.0f), {});
  const SE3 back = map_.KeyframePose(1).Inverse() * pose_;
  SpawnedGaussians right;
  right = Wall(0.1f);
  for (std::size_t i = 0; i < right.signals.size(); ++i) {
    WritePose(right.gaussians,
              i,
              (back * MeanOf(right.gaussians, i).cast<double>()).cast<float>(),
              (back.Rotation() * RotationOf(right.gaussians, i).cast<double>()).cast<float>());
  }
  map_.Append(1, right);
  ManageConfig config = In(ManageMode::kPlane);
  config.plane.fill = 0.5;
  Manage(config);
  ASSERT_EQ(map_.Engine().Ranges().size(), 1u);
  EXPECT_EQ(map_.Engine().Ranges()[0].anchor, 1);
}

TEST_F(ManageMapTest, SplitsTheMostComplexIntoHalvesThatTogetherAreTheWhole) {
  SpawnedGaussians spawned;
  spawned.gaussians.Resize(2);
  const Eigen::Quaterniond facing(Eigen::AngleAxisd(-0.5 * M_PI, Eigen::Vector3d::UnitY()));
  SetGaussian(spawned.gaussians, 0, {5, 0, 0}, facing, 0.2, 0.3, 0.8);
  SetGaussian(spawned.gaussians, 1, {5, 2, 0}, facing, 0.2, 0.3, 0.8);
  spawned.signals = {{.control_score = 0.2f}, {.control_score = 0.8f}};
  Add(spawned);
  const NearGaussians whole = map_.Near(pose_, kReach);
  Manage(In(ManageMode::kSplit));
  ASSERT_EQ(map_.Size(), 3u);
  const NearGaussians near = map_.Near(pose_, kReach);
  std::vector<PlanarGaussian> halves;
  for (std::size_t i = 0; i < near.discs.size(); ++i) {
    if (std::abs(near.discs[i].mean.y()) < 1.0f) continue;
    halves.push_back({near.discs[i], 0.8f});
    EXPECT_EQ(map_.Signals()[near.row[i]].control_score, 0.8f);
    EXPECT_EQ(map_.Signals()[near.row[i]].splits, 1);
    EXPECT_NEAR(near.discs[i].v.norm(), 0.15f, 1e-5f);
    EXPECT_NEAR(near.discs[i].u.norm(), 0.2f, 1e-5f);
  }
  ASSERT_EQ(halves.size(), 2u);
  const std::vector<PlaneCover> joined =
      CoverPlanes(halves, kExtentFactor, {.max_scale_m = 1.0, .max_share = 1.0});
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_LT((joined[0].disc.mean - whole.discs[1].mean).norm(), 1e-4f);
  EXPECT_NEAR(joined[0].disc.u.norm(), 0.3f, 1e-4f);
  EXPECT_NEAR(joined[0].disc.v.norm(), 0.2f, 1e-4f);
}

TEST_F(ManageMapTest, DoesNotSplitTheSameFamilyForEver) {
  SpawnedGaussians spawned = Wall(0.5f);
  for (std::size_t i = 0; i < spawned.signals.size(); ++i) {
    spawned.signals[i].control_score = 0.5f + 0.001f * static_cast<float>(i);
  }
  Add(spawned);
  ManageConfig config = In(ManageMode::kSplit);
  config.split.min_scale_m = 1e-3;
  config.split.control_quantile = 0.5;
  for (int round = 0; round < 100; ++round) Manage(config);
  EXPECT_EQ(map_.Size(), 256u + 100u) << "one at a time";
  std::set<float> parents;
  for (const AnchorRange& range : map_.Engine().Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const GaussianSignals& signals = map_.Signals()[i];
      EXPECT_LE(signals.splits, config.split.max_splits);
      if (signals.splits > 0) parents.insert(signals.control_score);
    }
  }
  EXPECT_GE(parents.size(), 100u / 3u) << "others get their turn";
}

TEST_F(ManageMapTest, ShedsWhatShowsLeastBeyondItsLimit) {
  Add(Wall(0.1f, 0.8));
  Add(Wall(0.1f, 0.3, 8.0));
  ManageConfig config = In(ManageMode::kOpacity);
  config.max_gaussians = 300;
  Manage(config);
  EXPECT_EQ(map_.Size(), 300u);
  std::size_t opaque = 0;
  for (const AnchorRange& range : map_.Engine().Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      opaque += map_.Engine().Gaussians().Column(kOpacityLogit)[i] > 0.0f;
    }
  }
  EXPECT_EQ(opaque, 256u);
  config.max_gaussians = 0;
  Manage(config);
  EXPECT_EQ(map_.Size(), 300u);
  config.budget_mb = 1e-6 * 100.5 * static_cast<double>(kBytesPerGaussian);
  Manage(config);
  EXPECT_EQ(map_.Size(), 100u);
}

TEST_F(ManageMapTest, OfAnEmptyMapDoesNothing) {
  Manage({});
  Add({});
  Manage({});
  EXPECT_EQ(map_.Size(), 0u);
}

}  // namespace
}  // namespace covsplat::test
