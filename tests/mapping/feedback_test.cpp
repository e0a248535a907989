#include "covsplat/mapping/feedback.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "tests/splat/scenes.hpp"
#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kReach = 50.0;
constexpr int kMaxAge = 100;

struct Surfel {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  double scale_u = 0.1;
  double scale_v = 0.1;
  double opacity = 0.8;
  float confidence = 1.0f;
  float control_score = 0.0f;
  float density = 0.0f;
};

SpawnedGaussians Spawned(const std::vector<Surfel>& surfels) {
  SpawnedGaussians spawned;
  spawned.gaussians.Resize(surfels.size());
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const Surfel& s = surfels[i];
    SetGaussian(spawned.gaussians, i, s.mean, s.q, s.scale_u, s.scale_v, s.opacity);
    spawned.signals.push_back(
        {.confidence = s.confidence, .control_score = s.control_score, .density = s.density});
  }
  return spawned;
}

class BuildTargetTest : public ::testing::Test {
 protected:
  void Add(const std::vector<Surfel>& surfels, const SE3& T_map_keyframe = SE3()) {
    map_.AddKeyframe(SphereKeyframe(T_map_keyframe, 0.0f), Spawned(surfels));
  }
  std::shared_ptr<const RegistrationTarget> Build(const FeedbackConfig& config = {},
                                                  const SE3& T_map_sensor = SE3()) {
    return BuildTarget(map_, std::nullopt, T_map_sensor, kReach, config);
  }
  /// The record of the Gaussian that was the `index`-th to be added.
  static const RegistrationTarget::Record& RecordOf(const RegistrationTarget& target, int index) {
    int slot = 0;
    while (target.SurfelOf(slot) != index) ++slot;
    return target.At(slot);
  }

  ThreadPool pool_{2};
  GaussianMap map_{std::move(MakeSplatEngine(Backend::kCpu, ReducedSensor(), {}, pool_).value()),
                   pool_};
};

TEST_F(BuildTargetTest, OfAnEmptyMapIsEmpty) { EXPECT_EQ(Build()->Size(), 0u); }

TEST_F(BuildTargetTest, LeavesOutPadding) {
  Add({{}, {}, {}});
  EXPECT_EQ(Build()->Size(), 3u);
}

TEST_F(BuildTargetTest, LeavesOutWhatIsTooTransparent) {
  Add({{.mean = {1, 0, 0}, .opacity = 0.29}, {.mean = {2, 0, 0}, .opacity = 0.31}});
  const auto target = Build({.min_opacity = 0.3});
  ASSERT_EQ(target->Size(), 1u);
  EXPECT_EQ(target->At(0).mean.x(), 2.0f);
}

TEST_F(BuildTargetTest, LeavesOutWhatIsTooUncertain) {
  // gamma = opacity * confidence
  Add({{.mean = {1, 0, 0}, .opacity = 0.8, .confidence = 0.36f},
       {.mean = {2, 0, 0}, .opacity = 0.8, .confidence = 0.39f}});
  EXPECT_EQ(Build({.min_confidence = 0.0})->Size(), 2u);
  const auto target = Build({.min_confidence = 0.3});
  ASSERT_EQ(target->Size(), 1u);
  EXPECT_EQ(target->At(0).mean.x(), 2.0f);
}

TEST_F(BuildTargetTest, LeavesOutWhatHasNotBeenSeenForLong) {
  Add({{.mean = {5, 0, 0}}, {.mean = {0, 5, 0}}});
  Add({{.mean = {0, -5, 0}}});
  Add({});
  const FeedbackConfig one_keyframe{.max_keyframe_age = 1};
  ASSERT_EQ(Build(one_keyframe)->Size(), 1u);
  EXPECT_EQ(Build(one_keyframe)->At(0).mean.y(), -5.0f);
  EXPECT_EQ(Build({.max_keyframe_age = 2})->Size(), 3u);
  // Seeing a Gaussian again keeps it.
  const SensorModel sensor = ReducedSensor();
  Keyframe ahead = SphereKeyframe(SE3(), 0.0f);
  for (int row = 0; row < sensor.Rows(); ++row) {
    ahead.measurement.range_m(row, sensor.Columns() / 2) = 5.0f;
  }
  map_.MarkSeen(2, ahead, sensor, kMaxAge);
  EXPECT_EQ(Build(one_keyframe)->Size(), 2u);
}

TEST_F(BuildTargetTest, LeavesOutWhatWasSeenThroughUntilItIsSeenAgain) {
  Add({{.mean = {5, 0, 0}}, {.mean = {0, 8, 0}}});
  const SensorModel sensor = ReducedSensor();
  map_.MarkSeen(0, SphereKeyframe(SE3(), 8.0f), sensor, kMaxAge);
  ASSERT_EQ(Build()->Size(), 1u);
  EXPECT_EQ(Build()->At(0).mean.y(), 8.0f);
  EXPECT_EQ(Build({.max_seen_through = 1})->Size(), 2u);
  EXPECT_EQ(Build({.mode = FeedbackMode::kNoFilter})->Size(), 2u);
  map_.MarkSeen(0, SphereKeyframe(SE3(), 5.0f), sensor, kMaxAge);
  EXPECT_EQ(Build()->Size(), 2u);
}

TEST_F(BuildTargetTest, ReachesAroundThePose) {
  Add({{.mean = {kReach - 1, 0, 0}}, {.mean = {kReach + 1, 0, 0}}});
  EXPECT_EQ(Build()->Size(), 1u);
  EXPECT_EQ(Build({}, MakePose(0, 0, 0, 20, 0, 0))->Size(), 2u);
  EXPECT_EQ(Build({}, MakePose(0, 0, 0, 500, 0, 0))->Size(), 0u);
}

TEST_F(BuildTargetTest, IsInTheMapFrame) {
  const SE3 T_map_keyframe = MakePose(0.2, -0.3, 1.0, 4, 5, 6);
  const Surfel surfel{.mean = {3, -2, 1}, .q = MakePose(0.4, 0.5, 0.6, 0, 0, 0).Rotation()};
  Add({surfel}, T_map_keyframe);
  const auto target = Build({}, MakePose(0, 0, 0, 2.4, 3.4, 0));
  ASSERT_EQ(target->Size(), 1u);
  EXPECT_EQ(target->OriginMap(), Eigen::Vector3d(2, 3, 0));
  const Eigen::Vector3d mean = target->OriginMap() + target->At(0).mean.cast<double>();
  EXPECT_LT((mean - T_map_keyframe * surfel.mean).norm(), 1e-5);
  const Eigen::Vector3d normal = T_map_keyframe.Rotation() * (surfel.q * Eigen::Vector3d::UnitZ());
  EXPECT_LT((target->At(0).normal.cast<double>() - normal).norm(), 1e-5);
}

TEST_F(BuildTargetTest, IsAsPreciseFarFromTheOriginAsNearIt) {
  std::vector<Surfel> surfels;
  Rng rng(7);
  for (int i = 0; i < 50; ++i) {
    surfels.push_back({.mean = {rng.Uniform(-20, 20), rng.Uniform(-20, 20), rng.Uniform(-2, 5)}});
  }
  const Eigen::Vector3d far_away(4000, -3000, 7);  // 5 km
  const SE3 near = MakePose(0.01, 0.02, 2.0, 0.3, -0.2, 0.1);
  const SE3 far(near.Rotation(), near.Translation() + far_away);
  Add(surfels, near);
  const auto at_home = Build({}, near);
  GaussianMap remote(std::move(MakeSplatEngine(Backend::kCpu, ReducedSensor(), {}, pool_).value()),
                     pool_);
  remote.AddKeyframe(SphereKeyframe(far, 0.0f), Spawned(surfels));
  const auto abroad = BuildTarget(remote, std::nullopt, far, kReach, {});
  ASSERT_EQ(at_home->Size(), surfels.size());
  ASSERT_EQ(abroad->Size(), surfels.size());
  EXPECT_EQ(abroad->OriginMap() - at_home->OriginMap(), far_away);
  for (int i = 0; i < static_cast<int>(surfels.size()); ++i) {
    EXPECT_LT((RecordOf(*abroad, i).mean - RecordOf(*at_home, i).mean).norm(), 1e-3f);
  }
}

TEST_F(BuildTargetTest, WeighsRoundGaussiansMoreThanNeedles) {
  std::vector<Surfel> surfels;
  for (int i = 0; i < 40; ++i) {
    surfels.push_back({.mean = {0.5 * i, 0, 0}, .scale_u = i % 2 == 0 ? 0.1 : 0.5});
  }
  Add(surfels);
  const auto target = Build({.weight = MatchWeight::kScales});
  ASSERT_EQ(target->Size(), surfels.size());
  // Paper eq. 5: w_max = 10 at the least curvature, 1 at the largest.
  EXPECT_FLOAT_EQ(RecordOf(*target, 0).weight, 10.0f);
  EXPECT_NEAR(RecordOf(*target, 1).weight, 1.0f, 0.01f);
}

TEST_F(BuildTargetTest, WeighsMatchesAsAsked) {
  Add({{.opacity = 0.5, .confidence = 0.6f, .control_score = 0.2f, .density = 1000.0f},
       {.mean = {1, 0, 0}, .confidence = 0.0f, .control_score = std::nanf("")}});
  const auto weights = [&](const FeedbackConfig& config) {
    const auto target = Build(config);
    return std::pair(RecordOf(*target, 0).weight, RecordOf(*target, 1).weight);
  };
  const auto [sure, unsure] = weights({.weight = MatchWeight::kConfidence});
  EXPECT_NEAR(sure, 0.3f, 1e-6f);
  EXPECT_GT(unsure, 0.0f) << "no Gaussian is without any weight";
  const auto [simple, unknown] = weights({.weight = MatchWeight::kControl});
  EXPECT_NEAR(simple, 1.0f / 0.201f, 1e-5f);
  EXPECT_NEAR(unknown, 1.0f / 0.501f, 1e-5f);
  const auto [many, one] = weights({.weight = MatchWeight::kSupport});
  EXPECT_NEAR(many, 120.0f / 130.0f, 1e-5f);  // 1000 per m2 on 12 * 0.1 m * 0.1 m
  EXPECT_NEAR(one, 1.0f / 11.0f, 1e-6f);
  EXPECT_EQ(weights({.mode = FeedbackMode::kNoWeight}), std::pair(1.0f, 1.0f));
}

TEST_F(BuildTargetTest, TakesAllGaussiansWithoutAFilter) {
  Add({{.mean = {1, 0, 0}, .opacity = 0.005}, {.mean = {2, 0, 0}}});
  EXPECT_EQ(Build()->Size(), 1u);
  EXPECT_EQ(Build({.mode = FeedbackMode::kNoFilter})->Size(), 2u);
}

TEST_F(BuildTargetTest, TakesCovariancesFromTheGaussianAloneWhateverIsAroundIt) {
  const Surfel surfel{
      .mean = {2, 1, 0}, .q = MakePose(0.4, 0.5, 0.6, 0, 0, 0).Rotation(), .scale_u = 0.3};
  Add({surfel});
  const auto alone = Build();
  std::vector<Surfel> crowd;
  Rng rng(9);
  for (int i = 0; i < 100; ++i) {
    crowd.push_back({.mean = surfel.mean + 0.2 * Eigen::Vector3d(rng.Normal(), rng.Normal(), 0),
                     .scale_u = rng.Uniform(0.05, 0.5)});
  }
  Add(crowd);
  const auto crowded = Build();
  ASSERT_EQ(crowded->Size(), 101u);
  EXPECT_EQ(RecordOf(*crowded, 0).covariance, RecordOf(*alone, 0).covariance);
  const Eigen::Matrix<float, 6, 1> expected =
      SurfaceCovariance(surfel.q.toRotationMatrix().cast<float>(), 0.3f, 0.1f);
  EXPECT_LT((RecordOf(*alone, 0).covariance - expected).norm(), 1e-4f * expected.norm());
}

TEST_F(BuildTargetTest, LeavesOutGaussiansThatAreNoLongerFinite) {
  Add({{.mean = {std::nan(""), 0, 0}}, {.opacity = std::nan("")}, {.mean = {1, 0, 0}}});
  ASSERT_EQ(Build()->Size(), 1u);
  EXPECT_EQ(Build()->At(0).mean.x(), 1.0f);
}

TEST(ScaleWeights, PreferRoundSurfelsAndIgnoreASingleNeedle) {
  std::vector<Eigen::Vector2f> scales;
  for (int k = 0; k < 100; ++k) {
    scales.emplace_back(0.2f, 0.2f * (1.0f + 0.02f * static_cast<float>(k)));
  }
  const std::vector<float> before = ScaleWeights(scales);
  EXPECT_FLOAT_EQ(before.front(), 10.0f);
  EXPECT_NEAR(before.back(), 1.0f, 0.01f);
  EXPECT_TRUE(std::is_sorted(before.rbegin(), before.rend()));
  scales.emplace_back(100.0f, 1e-4f);
  const std::vector<float> after = ScaleWeights(scales);
  EXPECT_NEAR(after[50], before[50], 0.1f);
}

TEST(ScaleWeights, AreEqualWithoutContrast) {
  const std::vector<Eigen::Vector2f> scales(10, Eigen::Vector2f(0.3f, 0.1f));
  for (const float weight : ScaleWeights(scales)) EXPECT_FLOAT_EQ(weight, 10.0f);
  EXPECT_TRUE(ScaleWeights({}).empty());
}

}  // namespace
}  // namespace covsplat::test
