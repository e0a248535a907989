#include "covsplat/mapping/gaussian_map.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "tests/splat/scenes.hpp"
#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kOpaque = 0.8;
constexpr double kTransparent = 0.02;
constexpr double kPruneOpacity = 0.05;
constexpr int kMaxAge = 100;

/// Gaussians that carry their own number everywhere: in the mean and in all signals. Every third is
/// too transparent to stay.
SpawnedGaussians Tagged(int first, int count) {
  SpawnedGaussians spawned;
  spawned.gaussians.Resize(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const int tag = first + i;
    const double opacity = tag % 3 == 0 ? kTransparent : kOpaque;
    SetGaussian(spawned.gaussians,
                static_cast<std::size_t>(i),
                {static_cast<double>(tag), 0.0, 0.0},
                Eigen::Quaterniond::Identity(),
                0.1,
                0.1,
                opacity);
    spawned.signals.push_back({.confidence = 1e-3f * static_cast<float>(tag),
                               .control_score = static_cast<float>(-tag),
                               .density = 2.0f * static_cast<float>(tag),
                               .intensity = 3.0f * static_cast<float>(tag)});
  }
  return spawned;
}

/// One Gaussian at each of some places in the keyframe's frame.
SpawnedGaussians GaussiansAt(const std::vector<Eigen::Vector3d>& places) {
  SpawnedGaussians spawned;
  spawned.gaussians.Resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    SetGaussian(spawned.gaussians, i, places[i], Eigen::Quaterniond::Identity(), 0.1, 0.1, kOpaque);
  }
  spawned.signals.assign(places.size(), {.confidence = 1.0f, .control_score = 0.0f});
  return spawned;
}

class GaussianMapTest : public ::testing::Test {
 protected:
  int Add(int first, int count) {
    return map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), Tagged(first, count));
  }

  void ExpectAlignedRows() {
    for (const AnchorRange& range : map_.Engine().Ranges()) {
      for (std::size_t i = range.begin; i < range.end; ++i) {
        const float tag = map_.Engine().Gaussians().Column(kMeanX)[i];
        const GaussianSignals& signals = map_.Signals()[i];
        EXPECT_EQ(signals.confidence, 1e-3f * tag);
        EXPECT_EQ(signals.control_score, -tag);
        EXPECT_EQ(signals.density, 2.0f * tag);
        EXPECT_EQ(signals.intensity, 3.0f * tag);
        EXPECT_EQ(signals.last_seen, range.anchor);
        EXPECT_TRUE(signals.trackable);
        for (int p = 0; p < kParameterCount; ++p) {
          EXPECT_EQ(map_.AsSpawned().Column(p)[i], map_.Engine().Gaussians().Column(p)[i]);
        }
      }
    }
    EXPECT_EQ(map_.AsSpawned().Size(), map_.Engine().Gaussians().Size());
    EXPECT_EQ(map_.Signals().size(), map_.Engine().Gaussians().Size());
  }

  int LastSeen(std::size_t row) const { return map_.Signals()[row].last_seen; }

  ThreadPool pool_{2};
  const SensorModel sensor_ = ReducedSensor();
  GaussianMap map_{std::move(MakeSplatEngine(Backend::kCpu, ReducedSensor(), {}, pool_).value()),
                   pool_};
};

TEST_F(GaussianMapTest, KeepsSignalsWithTheirGaussiansThroughAddingAndPruning) {
  EXPECT_EQ(Add(1, 5), 0);  // numbers that are no multiples of the block size
  EXPECT_EQ(Add(6, 37), 1);
  EXPECT_EQ(Add(43, 18), 2);
  EXPECT_EQ(map_.Size(), 60u);
  ExpectAlignedRows();
  EXPECT_EQ(map_.PruneOpacity(kPruneOpacity), 20u);
  EXPECT_EQ(map_.Size(), 40u);
  ExpectAlignedRows();
  EXPECT_EQ(Add(61, 30), 3);
  ExpectAlignedRows();
  EXPECT_EQ(map_.PruneOpacity(kPruneOpacity), 10u);
  EXPECT_EQ(map_.PruneOpacity(kPruneOpacity), 0u);
  EXPECT_EQ(map_.Size(), 60u);
  ExpectAlignedRows();
}

TEST_F(GaussianMapTest, MarksPaddingAsNotTrackable) {
  Add(1, 5);
  ASSERT_EQ(map_.Engine().Gaussians().Size(), kBlockSize);
  for (std::size_t i = 5; i < kBlockSize; ++i) EXPECT_FALSE(map_.Signals()[i].trackable);
}

TEST_F(GaussianMapTest, KeepsAKeyframeThatSpawnsNothingOrLosesAllItsGaussians) {
  EXPECT_EQ(Add(1, 0), 0);
  EXPECT_EQ(Add(3, 1), 1);  // too transparent
  EXPECT_EQ(Add(4, 1), 2);
  EXPECT_EQ(map_.PruneOpacity(kPruneOpacity), 1u);
  EXPECT_EQ(map_.Keyframes(), 3);
  EXPECT_EQ(map_.Size(), 1u);
  ExpectAlignedRows();
}

TEST_F(GaussianMapTest, PrunesGaussiansThatAreNoLongerFinite) {
  SpawnedGaussians spawned = Tagged(1, 2);
  SpawnedGaussians broken = GaussiansAt(std::vector<Eigen::Vector3d>(kParameterCount, {1, 2, 3}));
  for (int p = 0; p < kParameterCount; ++p) {
    broken.gaussians.Column(p)[p] = p % 2 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                               : std::numeric_limits<float>::infinity();
  }
  map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), broken);
  map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), spawned);
  map_.MarkSeen(1, SphereKeyframe(SE3(), 5.0f), sensor_, kMaxAge);  // must survive them
  for (const Disc& disc : map_.Near(SE3(), 10.0).discs) {
    EXPECT_TRUE(disc.mean.allFinite() && disc.u.allFinite() && disc.v.allFinite());
  }
  EXPECT_EQ(map_.PruneOpacity(kPruneOpacity), static_cast<std::size_t>(kParameterCount));
  EXPECT_EQ(map_.Size(), 2u);
  EXPECT_EQ(map_.Engine().Gaussians().Column(kMeanX)[0], 1.0f);
}

TEST_F(GaussianMapTest, MarksAsSeenOnlyWhatAKeyframeMeasuresInItsPlace) {
  const SE3 first = MakePose(0, 0, 0.5, 10, -4, 1);
  map_.AddKeyframe(SphereKeyframe(first, 5.0f),
                   GaussiansAt({{5, 0, 0}, {0, 5, 0}, {8, 0, 0}, {3, 0, 0}}));
  // 1 m on and turned half round: only the first Gaussian is 4 m away.
  const SE3 second = first * MakePose(0, 0, std::numbers::pi, 1, 0, 0);
  const Keyframe keyframe = SphereKeyframe(second, 4.0f);
  const int number = map_.AddKeyframe(keyframe, {});
  map_.MarkSeen(number, keyframe, sensor_, kMaxAge);
  EXPECT_EQ(LastSeen(0), 1);
  EXPECT_EQ(LastSeen(1), 0);
  EXPECT_EQ(LastSeen(2), 0);
  EXPECT_EQ(LastSeen(3), 0);
}

TEST_F(GaussianMapTest, PrunesWhatKeyframesInARowSeeThrough) {
  map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), GaussiansAt({{5, 0, 0}, {3, 0, 0}, {6, 0, 0}}));
  const auto pruned_by = [&](float range_m) {
    const Keyframe keyframe = SphereKeyframe(SE3(), range_m);
    return map_.PruneSeenThrough(map_.MarkSeen(0, keyframe, sensor_, kMaxAge), 2);
  };
  EXPECT_EQ(pruned_by(5.0f), 0u) << "the second is in front, the third behind";
  EXPECT_EQ(pruned_by(3.0f), 0u) << "now it is where it was: it counts anew";
  EXPECT_EQ(pruned_by(5.0f), 0u);
  EXPECT_EQ(pruned_by(5.0f), 1u);
  EXPECT_EQ(map_.Size(), 2u);
}

TEST_F(GaussianMapTest, KeepsWhatWasLongUnseenWhileTheWayMayHaveDrifted) {
  // Two walls of spheres that a drifted keyframe sees 1 m farther away, or one of them.
  std::vector<Eigen::Vector3d> wall;
  for (int i = 0; i < 100; ++i) {
    wall.push_back(Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitZ()) *
                   Eigen::Vector3d(5, 0, 0));
  }
  const auto through_after = [&](int keyframes, std::size_t moved) {
    map_ =
        GaussianMap(std::move(MakeSplatEngine(Backend::kCpu, sensor_, {}, pool_).value()), pool_);
    std::vector<Eigen::Vector3d> points = wall;
    for (std::size_t i = 0; i < moved; ++i) points[i] *= 0.8;
    map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), GaussiansAt(points));
    Keyframe sphere = SphereKeyframe(SE3(), 5.0f);
    for (int row = 0; row < sensor_.Rows(); ++row) {
      for (int column = 0; column < sensor_.Columns(); ++column) {
        sphere.measurement.normal(row, column) = -sensor_.RayOf(row, column);
      }
    }
    map_.MarkSeen(keyframes, sphere, sensor_, kMaxAge);
    return map_.PruneSeenThrough(map_.MarkSeen(keyframes + 1, sphere, sensor_, kMaxAge), 2);
  };
  EXPECT_EQ(through_after(kMaxAge - 1, 40), 40u) << "a moment ago they were there";
  EXPECT_EQ(through_after(kMaxAge + 1, 40), 0u) << "all of the map is elsewhere";
  EXPECT_EQ(through_after(kMaxAge + 1, 4), 4u) << "the others are where they were";
}

TEST_F(GaussianMapTest, SeesWhatWasLongUnseenAgainOnlyOnTheSurfaceThatIsMeasured) {
  map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), GaussiansAt({{5.15, 0, 0}, {5.05, 0.05, 0}}));
  Keyframe sphere = SphereKeyframe(SE3(), 5.0f);
  map_.MarkSeen(kMaxAge, sphere, sensor_, kMaxAge);
  EXPECT_EQ(LastSeen(0), kMaxAge) << "a moment ago within 10 cm and 2 %";
  map_.MarkSeen(3 * kMaxAge, sphere, sensor_, kMaxAge);
  EXPECT_EQ(LastSeen(1), kMaxAge) << "without a normal nobody knows";
  for (int row = 0; row < sensor_.Rows(); ++row) {
    for (int column = 0; column < sensor_.Columns(); ++column) {
      sphere.measurement.normal(row, column) = -sensor_.RayOf(row, column);
    }
  }
  map_.MarkSeen(3 * kMaxAge, sphere, sensor_, kMaxAge);
  EXPECT_EQ(LastSeen(0), kMaxAge);
  EXPECT_EQ(LastSeen(1), 3 * kMaxAge);
}

TEST_F(GaussianMapTest, FindsDiscsAroundAPoseInItsFrame) {
  const SE3 keyframe = MakePose(0, 0, 0.5, 1000, -400, 1);
  map_.AddKeyframe(SphereKeyframe(keyframe, 5.0f), GaussiansAt({{5, 0, 0}, {0, 15, 0}}));
  const SE3 pose = keyframe * MakePose(0, 0, std::numbers::pi, 1, 0, 0);
  const NearGaussians near = map_.Near(pose, 10.0);
  ASSERT_EQ(near.discs.size(), 1u);  // no padding, nothing from farther away
  EXPECT_LT((near.discs[0].mean - Eigen::Vector3f(-4, 0, 0)).norm(), 1e-5f);
  EXPECT_NEAR(near.discs[0].u.dot(near.discs[0].v), 0.0f, 1e-6f);
  EXPECT_TRUE(map_.Near(SE3(), 10.0).discs.empty());
  EXPECT_EQ(map_.Remove(near.row), 1u);
  EXPECT_TRUE(map_.Near(pose, 10.0).discs.empty());
  EXPECT_EQ(map_.Size(), 1u);
}

TEST_F(GaussianMapTest, DoesNotMarkAsSeenWhatIsBehindAGapOrOutOfView) {
  map_.AddKeyframe(SphereKeyframe(SE3(), 5.0f), GaussiansAt({{5, 0, 0}, {0.1, 0, 5}}));
  map_.AddKeyframe(SphereKeyframe(SE3(), 0.0f), {});
  map_.MarkSeen(1, SphereKeyframe(SE3(), 0.0f), sensor_, kMaxAge);  // no returns at all
  map_.MarkSeen(1,
                SphereKeyframe(SE3(), 4.7f),
                sensor_,
                kMaxAge);  // something in front, beyond the tolerance
  EXPECT_EQ(LastSeen(0), 0);
  map_.MarkSeen(1, SphereKeyframe(SE3(), 4.9f), sensor_, kMaxAge);  // within 10 cm + 2 %
  EXPECT_EQ(LastSeen(0), 1);
  EXPECT_EQ(LastSeen(1), 0) << "nearly straight above";
}

}  // namespace
}  // namespace covsplat::test
