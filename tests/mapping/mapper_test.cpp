#include "covsplat/mapping/mapper.hpp"

#include <cstring>
#include <utility>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.02;
constexpr int kKeyframes = kSanitized ? 3 : 6;

SE3 PoseOfKeyframe(int k) { return MakePose(0.0, 0.0, 0.3 * k, 0.8 * k - 2.0, 0.2 * k, 0.05 * k); }

MapperConfig Frozen() {
  MapperConfig config;
  config.feedback.mode = FeedbackMode::kFrozen;
  return config;
}

class MapperTest : public ::testing::Test {
 protected:
  std::unique_ptr<Mapper> MakeMapper(const MapperConfig& config = {}) {
    auto engine = std::move(MakeSplatEngine(Backend::kCpu, sensor_, config.engine, pool_).value());
    return std::make_unique<Mapper>(std::move(engine), sensor_, config, pool_);
  }
  Keyframe KeyframeAt(int k) {
    return StillKeyframe(
        Room(), sensor_, PoseOfKeyframe(k), kNoise, static_cast<std::uint64_t>(k), pool_);
  }
  std::unique_ptr<Mapper> MapTheRoom(const MapperConfig& config) {
    auto mapper = MakeMapper(config);
    for (int k = 0; k < kKeyframes; ++k) {
      mapper->Insert(KeyframeAt(k));
      mapper->OptimizeNewest();
    }
    return mapper;
  }
  /// Against the truth, from a pose between the keyframes.
  double HeldOutError(Mapper& mapper) {
    const SE3 pose = MakePose(0.02, -0.02, 1.0, -1.2, 0.6, 0.1);
    return MeanRangeError(mapper.Render(pose).range_m, TrueRanges(Room(), sensor_, pose));
  }

  const SensorModel sensor_ = ReducedSensor();
  ThreadPool pool_{2};
};

TEST_F(MapperTest, OptimisingMakesTheMapBetterWhereItWasNotMeasured) {
  const auto optimised = MapTheRoom({});
  const auto as_spawned = MapTheRoom(Frozen());
  const double after = HeldOutError(*optimised);
  const double before = HeldOutError(*as_spawned);
  EXPECT_LT(after, 0.9 * before);  // the rest is holes and edges
  EXPECT_LT(after, 0.15);          // rooms of 24 m x 18 m, 2 cm of noise
}

TEST_F(MapperTest, LeavesGaussiansAloneWhenTheMapIsFrozen) {
  MapperConfig config = Frozen();
  config.schedule.final_steps = 20;
  const auto mapper = MapTheRoom(config);
  mapper->OptimizeIdle();
  mapper->Conclude();
  EXPECT_EQ(mapper->Steps(), 0);
  const GaussianMap& map = mapper->Map();
  ASSERT_GT(map.Size(), 1000u);
  for (const AnchorRange& range : map.Engine().Ranges()) {
    for (int p = 0; p < kParameterCount; ++p) {
      EXPECT_EQ(std::memcmp(map.Engine().Gaussians().Column(p) + range.begin,
                            map.AsSpawned().Column(p) + range.begin,
                            (range.end - range.begin) * sizeof(float)),
                0);
    }
  }
}

TEST_F(MapperTest, SpendsItsBudgetAndNoMore) {
  MapperConfig config;
  config.schedule = {
      .steps_new = 3, .steps_near = 2, .steps_old = 1, .steps_per_visit = 4, .final_steps = 10};
  const auto mapper = MakeMapper(config);
  mapper->OptimizeNewest();
  mapper->OptimizeIdle();
  mapper->Conclude();
  EXPECT_EQ(mapper->Steps(), 0) << "there is nothing to optimise yet";
  mapper->Insert(KeyframeAt(0));
  EXPECT_EQ(mapper->Steps(), 0);
  mapper->OptimizeNewest();
  EXPECT_EQ(mapper->Steps(), 6);
  mapper->OptimizeIdle();
  EXPECT_EQ(mapper->Steps(), 10);
  mapper->Conclude();
  EXPECT_EQ(mapper->Steps(), 20) << "10 in visits of 4, 4 and 2";
  EXPECT_EQ(mapper->Views().Training()[0].steps, 20);
  EXPECT_TRUE(mapper->Views().Empty()) << "nothing more will come";
}

TEST_F(MapperTest, StopsAVisitWhenThereIsSomethingElseToDo) {
  MapperConfig config;
  config.schedule.steps_per_visit = 8;
  const auto mapper = MakeMapper(config);
  mapper->Insert(KeyframeAt(0));
  int asked = 0;
  mapper->OptimizeIdle([&] { return ++asked == 3; });
  EXPECT_EQ(mapper->Steps(), 3);
  mapper->OptimizeIdle([] { return true; });
  EXPECT_EQ(mapper->Steps(), 4) << "a visit has one step at least";
}

TEST_F(MapperTest, KeepsOneViewOfAPlace) {
  MapperConfig config;
  config.schedule.view_spacing_m = 1.0;
  const auto mapper = MakeMapper(config);
  const auto go_to = [&](double x_m, int seed) {
    mapper->Insert(StillKeyframe(Room(),
                                 sensor_,
                                 MakePose(0, 0, 0, x_m, 0, 0),
                                 kNoise,
                                 static_cast<std::uint64_t>(seed),
                                 pool_));
    mapper->OptimizeNewest();
    return mapper->Views().Keyframes();
  };
  using Views = std::vector<int>;
  EXPECT_EQ(go_to(0.0, 0), (Views{0}));
  EXPECT_EQ(go_to(0.7, 1), (Views{0, 1})) << "the newest stays until the next";
  EXPECT_EQ(go_to(1.4, 2), (Views{0, 2}));
  EXPECT_EQ(go_to(4.0, 3), (Views{0, 2, 3}));
  EXPECT_EQ(go_to(0.2, 4), (Views{0, 2, 3, 4}));
  EXPECT_EQ(go_to(2.0, 5), (Views{2, 3, 4, 5})) << "a second time round, the first goes";
  mapper->OptimizeIdle();
  mapper->Conclude();
}

TEST_F(MapperTest, ManagesOnceMoreWhenTheRecordingHasEnded) {
  MapperConfig config = Frozen();
  config.manage.max_gaussians = 500;
  config.manage.interval = 100;
  const auto mapper = MakeMapper(config);
  mapper->Conclude();
  mapper->Insert(KeyframeAt(0));
  EXPECT_GT(mapper->Map().Size(), 500u);
  mapper->Conclude();
  EXPECT_EQ(mapper->Map().Size(), 500u);
}

TEST_F(MapperTest, RemembersHowGaussiansWereSpawned) {
  const auto mapper = MakeMapper();
  mapper->Insert(KeyframeAt(0));
  const GaussianColumns<float> before = mapper->Map().Engine().Gaussians();
  mapper->OptimizeNewest();
  const GaussianColumns<float>& spawned = mapper->Map().AsSpawned();
  const GaussianColumns<float>& now = mapper->Map().Engine().Gaussians();
  const std::size_t bytes = mapper->Map().Size() * sizeof(float);
  EXPECT_EQ(std::memcmp(spawned.Column(kOpacityLogit), before.Column(kOpacityLogit), bytes), 0);
  EXPECT_NE(std::memcmp(spawned.Column(kOpacityLogit), now.Column(kOpacityLogit), bytes), 0);
}

TEST_F(MapperTest, PrunesWhatHasBecomeTransparentEveryFewKeyframes) {
  MapperConfig config = Frozen();
  config.manage.prune_opacity = 0.5;
  config.manage.interval = 2;
  const auto mapper = MakeMapper(config);
  mapper->Insert(KeyframeAt(0));
  const std::size_t all = mapper->Map().Size();
  const auto transparent = [&] {
    std::size_t count = 0;
    const GaussianMap& map = mapper->Map();
    for (const AnchorRange& range : map.Engine().Ranges()) {
      for (std::size_t i = range.begin; i < range.end; ++i) {
        count += map.Engine().Gaussians().Column(kOpacityLogit)[i] < 0.0f;
      }
    }
    return count;
  };
  ASSERT_GT(transparent(), 0u);
  mapper->Insert(KeyframeAt(0));
  EXPECT_EQ(transparent(), 0u);
  EXPECT_LT(mapper->Map().Size(), all);
}

TEST_F(MapperTest, MakesNothingOfWhatStandsWhereItHasSeenThrough) {
  const Box thing{{3.0, 1.0, -1.5}, {4.0, 2.0, 0.5}};
  const auto gaussians_on_it = [&](bool masks) {
    MapperConfig config = Frozen();
    config.reliability.enabled = masks;
    const auto mapper = MakeMapper(config);
    for (int k = 0; k < config.reliability.min_seen_through; ++k) mapper->Insert(KeyframeAt(k));
    RayScene scene = Room();
    scene.Add(thing);
    const SE3 pose = PoseOfKeyframe(config.reliability.min_seen_through);
    mapper->Insert(StillKeyframe(scene, sensor_, pose, kNoise, 9, pool_));
    std::size_t count = 0;
    for (const Disc& disc : mapper->Map().Near(SE3(), 100.0).discs) {
      const Eigen::Vector3d mean = disc.mean.cast<double>();
      count += (mean.array() > thing.low.array() - 0.1).all() &&
               (mean.array() < thing.high.array() + 0.1).all() && mean.z() > thing.low.z() + 0.3;
    }
    return count;
  };
  const std::size_t unmasked = gaussians_on_it(false);
  EXPECT_GT(unmasked, 20u);
  EXPECT_LT(gaussians_on_it(true), unmasked / 5);
}

TEST_F(MapperTest, MakesTargetsOfTheKeyframesThatItHas) {
  const auto mapper = MakeMapper();
  const auto none = mapper->MakeTarget(SE3());
  EXPECT_EQ(none->Size(), 0u);
  EXPECT_EQ(none->Keyframes(), 0);
  mapper->Insert(KeyframeAt(0));
  const auto first = mapper->MakeTarget(PoseOfKeyframe(0));
  EXPECT_EQ(first->Size(), mapper->Map().Size());
  EXPECT_EQ(first->Keyframes(), 1);
}

TEST_F(MapperTest, ACorrectionMovesGaussiansWithTheirKeyframesAndNothingForTheTracker) {
  const auto mapper = MakeMapper(Frozen());
  for (int k = 0; k < 4; ++k) mapper->Insert(KeyframeAt(k));
  const auto pose = [&](int k) { return mapper->Map().KeyframePose(k); };
  const auto seen_from = [&](int k) { return mapper->Map().Near(pose(k), 100.0); };
  const NearGaussians before = seen_from(1);
  const auto target = mapper->MakeTarget(PoseOfKeyframe(3));
  EXPECT_FALSE(mapper->OdomPose());

  // A loop moves the first three, each otherwise; the fourth goes with the third.
  std::vector<SE3> corrected;
  for (int k = 0; k < 3; ++k)
    corrected.push_back(MakePose(0, 0, 0.01 * k, 0.3, 0.1 * k, 0) * pose(k));
  const SE3 T_third_fourth = pose(2).Inverse() * pose(3);
  mapper->Correct(corrected);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(TranslationError(pose(k), corrected[static_cast<std::size_t>(k)]), 1e-12);
  }
  EXPECT_LT(TranslationError(pose(3), corrected[2] * T_third_fourth), 1e-12);

  // What came with a keyframe has not moved as that one sees it.
  const NearGaussians after = seen_from(1);
  ASSERT_EQ(after.discs.size(), before.discs.size());
  std::size_t of_the_second = 0;
  for (std::size_t i = 0; i < after.discs.size(); ++i) {
    if (after.keyframe[i] != 1) continue;
    ++of_the_second;
    EXPECT_LT((after.discs[i].mean - before.discs[i].mean).norm(), 1e-4f);
  }
  EXPECT_GT(of_the_second, 10u);

  // In the frame of odometry the newest keyframe and what came with it are where they were.
  ASSERT_TRUE(mapper->OdomPose());
  EXPECT_LT(TranslationError(*mapper->OdomPose() * PoseOfKeyframe(3), pose(3)), 1e-9);
  const auto moved = mapper->MakeTarget(PoseOfKeyframe(3));
  ASSERT_EQ(moved->Size(), target->Size());
  EXPECT_LT((moved->OriginMap() - target->OriginMap()).norm(), 1e-9);

  // Scans go on in that frame, and arrive in the map beside those before.
  mapper->Insert(KeyframeAt(4));
  const SE3 step = PoseOfKeyframe(3).Inverse() * PoseOfKeyframe(4);
  EXPECT_LT(TranslationError(pose(3).Inverse() * pose(4), step), 1e-9);
}

TEST_F(MapperTest, InTheEndSurfacesThatLoopsBroughtTogetherAreJoined) {
  MapperConfig config = Frozen();
  config.manage.interval = 1;
  const auto mapper = MakeMapper(config);
  mapper->Insert(KeyframeAt(0));
  Keyframe drifted = KeyframeAt(0);
  drifted.tracked.T_odom_sensor = MakePose(0, 0, 0, 0.5, 0.5, 0.5) * PoseOfKeyframe(0);
  mapper->Insert(std::move(drifted));
  const std::size_t twice = mapper->Map().Size();
  mapper->Correct(std::vector<SE3>{PoseOfKeyframe(0), PoseOfKeyframe(0)});
  EXPECT_EQ(mapper->Map().Size(), twice);
  mapper->Conclude();
  EXPECT_LT(mapper->Map().Size(), 9 * twice / 10);
}

}  // namespace
}  // namespace covsplat::test
