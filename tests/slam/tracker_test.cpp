#include "covsplat/slam/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.01;
constexpr double kSpeed = 1.5;        // m/s
constexpr double kSameM = 0.03;       // a tracked pose; the scan has 1 cm of noise
constexpr double kSameRad = 5e-3;     // 3 cm at 6 m
constexpr double kPredictedM = 0.06;  // one blind scan; a sensor that had stopped is off by 15 cm

SE3 Still(double) { return {}; }
/// Straight ahead from the middle of the room, where the map frame is.
SE3 Drive(double t) { return MakePose(0, 0, 0, kSpeed * t, 0, 0); }
SE3 Turn(double t) { return MakePose(0, 0, 1.0 * t, 0, 0, 0); }
/// At rest, and with scan k all at once elsewhere.
Motion JumpAt(int k, const SE3& pose) {
  return [=](double t) { return t < kScanPeriod * (k - 0.5) ? SE3() : pose; };
}

class TrackerTest : public ::testing::Test {
 protected:
  static double StampOf(int k) { return kScanPeriod * k; }

  Scan ScanOf(const Motion& motion, int k, const RayScene& scene = Room()) {
    Scan scan = Simulate(scene, sensor_, motion, StampOf(k), kNoise, static_cast<std::uint64_t>(k));
    scan.index = k;
    return scan;
  }
  /// As a sensor that measures everything at once, or one whose driver has deskewed.
  Scan InstantScanOf(const Motion& motion, int k) {
    Scan scan = ScanOf([&](double) { return motion(StampOf(k)); }, k);
    scan.stamp_s = StampOf(k);
    scan.time_offset_s.clear();
    return scan;
  }
  Scan EmptyScan(int k) {
    Scan scan;
    scan.index = k;
    scan.stamp_s = StampOf(k);
    return scan;
  }
  /// Points without any surface.
  Scan GarbageScan(int k) {
    Scan scan = ScanOf(Still, k);
    Rng rng(static_cast<std::uint64_t>(k));
    for (Eigen::Vector3f& p : scan.points) {
      p = Eigen::Vector3d(rng.Uniform(-15, 15), rng.Uniform(-15, 15), rng.Uniform(-15, 15))
              .cast<float>();
    }
    return scan;
  }

  /// The room as it is, along the way of `Drive`.
  RegistrationTarget MapOfTheRoom() {
    std::vector<TargetSurfel> surfels;
    for (const double x : {0.0, 3.0, 6.0}) {
      const SE3 pose = MakePose(0, 0, 0, x, 0, 0);
      AppendSurfels(StillCloud(Room(), pose, kNoise, 100, pool_), pose, surfels);
    }
    return {surfels, Eigen::Vector3d::Zero(), 1};
  }

  /// The first scans of a motion, tracked; the tracker then knows how it moves.
  void TrackFirst(Tracker& tracker, const Motion& motion, int scans) {
    for (int k = 0; k < scans; ++k) tracker.Track(ScanOf(motion, k), &map_);
  }

  static void ExpectAt(const TrackResult& result, const SE3& truth) {
    EXPECT_EQ(result.state, TrackState::kTracking);
    EXPECT_LT(TranslationError(result.tracked.T_odom_sensor, truth), kSameM);
    EXPECT_LT(RotationError(result.tracked.T_odom_sensor, truth), kSameRad);
  }

  /// Median distance, along the rays, of the points behind the sensor from the surfaces that it
  /// sees from `pose`. They are the first and the last of a turn, and unlike floor and side walls
  /// they do not fit wherever along the way the sensor is.
  static double MedianMisfit(const std::vector<Eigen::Vector3f>& points, const SE3& pose) {
    const RayScene room = Room();
    std::vector<double> misfit;
    for (const Eigen::Vector3f& p : points) {
      if (p.x() > -0.9f * p.norm()) continue;
      const Eigen::Vector3d ray = pose.Rotation() * p.cast<double>().normalized();
      misfit.push_back(
          std::abs(room.Cast(pose.Translation(), ray) - static_cast<double>(p.norm())));
    }
    const auto middle = misfit.begin() + static_cast<std::ptrdiff_t>(misfit.size() / 2);
    std::nth_element(misfit.begin(), middle, misfit.end());
    return *middle;
  }

  const SensorModel sensor_ = ReducedSensor();
  ThreadPool pool_{2};
  const RegistrationTarget map_ = MapOfTheRoom();
};

TEST_F(TrackerTest, StartsWithTheFirstScanWithoutAMap) {
  Tracker tracker({}, pool_);
  const TrackResult result = tracker.Track(ScanOf(Drive, 0), nullptr);
  EXPECT_EQ(result.state, TrackState::kInitializing);
  EXPECT_FALSE(result.is_keyframe);
  EXPECT_FALSE(result.first);
  EXPECT_EQ(TranslationError(result.tracked.T_odom_sensor, SE3()), 0.0);
  EXPECT_TRUE(result.has_time);
}

TEST_F(TrackerTest, ReturnsTheFirstScanWithTheSecondDeskewedByTheMotionItHasFound) {
  Tracker tracker({}, pool_);
  const Scan first = ScanOf(Drive, 0);
  tracker.Track(first, nullptr);
  const TrackResult second = tracker.Track(ScanOf(Drive, 1), nullptr);
  ExpectAt(second, Drive(StampOf(1)));
  ASSERT_TRUE(second.first);
  EXPECT_EQ(second.first->scan, 0);
  EXPECT_EQ(second.first->points.size(), first.points.size());
  // 1.5 m/s make 15 cm per scan: raw points are off by up to 7.5 cm.
  const double raw = MedianMisfit(first.points, SE3());
  const double deskewed = MedianMisfit(second.first->points, SE3());
  EXPECT_GT(raw, 0.05);
  EXPECT_LT(deskewed, 2.0 * kNoise);
  EXPECT_FALSE(tracker.Track(ScanOf(Drive, 2), &map_).first) << "only once";
}

TEST_F(TrackerTest, TracksADriveAndDeskewsEveryScan) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 2);
  for (int k = 2; k < 10; ++k) {
    const TrackResult result = tracker.Track(ScanOf(Drive, k), &map_);
    ExpectAt(result, Drive(StampOf(k)));
    EXPECT_EQ(result.tracked.scan, k);
    EXPECT_NEAR(result.tracked.stamp_s, StampOf(k), 1e-6);
    EXPECT_LT(MedianMisfit(result.tracked.points, Drive(StampOf(k))), 3.0 * kNoise);
  }
}

TEST_F(TrackerTest, WithoutRefinementScansAreDeskewedByTheVelocityOfThoseBefore) {
  TrackerConfig config;
  config.deskew.refine = MotionModel::kRigid;
  Tracker tracker(config, pool_);
  TrackFirst(tracker, Drive, 3);  // the first twist is known after two
  for (int k = 3; k < 10; ++k) {
    const TrackResult result = tracker.Track(ScanOf(Drive, k), &map_);
    ExpectAt(result, Drive(StampOf(k)));
    EXPECT_LT(MedianMisfit(result.tracked.points, Drive(StampOf(k))), 3.0 * kNoise);
  }
}

TEST_F(TrackerTest, DescribesTheSurfacesOfDeskewedPoints) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Turn, 2);
  const TrackedScan tracked = tracker.Track(ScanOf(Turn, 2), &map_).tracked;
  ASSERT_EQ(tracked.covariance.size(), tracked.surface.size());
  ASSERT_EQ(tracked.squared_distance.size(), tracked.surface.size());
  // Floor and ceiling stay level, so their normals are upright in the frame of mid scan.
  std::size_t level = 0;
  for (std::size_t i = 0; i < tracked.surface.size(); ++i) {
    const Eigen::Vector3f p = tracked.surface[i];
    EXPECT_LE(tracked.covariance[i].axes.col(2).dot(p), 1e-3f * p.norm());
    if (std::abs(p.z() + 1.5f) > 0.03f || p.head<2>().norm() > 3.0f) continue;
    ++level;
    EXPECT_GT(tracked.covariance[i].axes(2, 2), 0.95f);
  }
  EXPECT_GT(level, 20u);
}

TEST_F(TrackerTest, PredictsThatTheSensorGoesOnAsBefore) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 5);
  const TrackResult blind = tracker.Track(EmptyScan(5), &map_);
  EXPECT_EQ(blind.state, TrackState::kLost);
  EXPECT_LT(TranslationError(blind.tracked.T_odom_sensor, Drive(StampOf(5))), kPredictedM);
}

TEST_F(TrackerTest, PredictsThatTheSensorGoesOnAsBeforeWithoutTimesOfPoints) {
  Tracker tracker({}, pool_);
  for (int k = 0; k < 5; ++k) {
    const TrackResult result = tracker.Track(InstantScanOf(Drive, k), &map_);
    EXPECT_FALSE(result.has_time);
    if (k > 0) ExpectAt(result, Drive(StampOf(k)));
  }
  const TrackResult blind = tracker.Track(EmptyScan(5), &map_);
  EXPECT_LT(TranslationError(blind.tracked.T_odom_sensor, Drive(StampOf(5))), kPredictedM);
}

TEST_F(TrackerTest, FollowsASensorWithoutTimesThatMovesFartherPerScanThanItMatches) {
  TrackerConfig config;
  config.gicp.max_correspondence_m = 0.4;  // of 0.5 m per scan in the end
  config.recovery.search_below = 0.0;
  Tracker tracker(config, pool_);
  const auto accelerate = [](double t) { return MakePose(0, 0, 0, 2.5 * t * t, 0, 0); };
  for (int k = 0; k <= 12; ++k) {
    const TrackResult result = tracker.Track(InstantScanOf(accelerate, k), &map_);
    if (k > 0) ExpectAt(result, accelerate(StampOf(k)));
  }
}

// From a start that is half a metre off along a way with few surfaces across it.
TEST_F(TrackerTest, StartsAtTheSpeedOfACar) {
  const auto fast = [](double t) { return MakePose(0, 0, 0, 5.0 * t, 0, 0); };
  Tracker tracker({}, pool_);
  tracker.Track(ScanOf(fast, 0), nullptr);
  ExpectAt(tracker.Track(ScanOf(fast, 1), nullptr), fast(StampOf(1)));
}

// So fast that from a standstill it would be an impossible acceleration.
TEST_F(TrackerTest, KnowsFromTheFirstTwoScansHowFastItIs) {
  const auto fast = [](double t) { return MakePose(0, 0, 0, 7.0 * t, 0, 0); };
  Tracker tracker({}, pool_);
  for (int k = 0; k < 4; ++k) {
    const TrackResult result = tracker.Track(InstantScanOf(fast, k), &map_);
    if (k > 0) ExpectAt(result, fast(StampOf(k)));
  }
}

TEST_F(TrackerTest, FindsOutHowItTurnedWhenNothingFitsTheWayItWent) {
  const Motion jolted = JumpAt(4, MakePose(0, 0, 0.9, 0.1, 0, 0));
  TrackerConfig blind;
  blind.recovery.search_below = 0.0;
  for (const bool searches : {true, false}) {
    Tracker tracker(searches ? TrackerConfig{} : blind, pool_);
    TrackFirst(tracker, jolted, 4);
    const TrackResult result = tracker.Track(InstantScanOf(jolted, 4), &map_);
    const double off_rad = RotationError(result.tracked.T_odom_sensor, jolted(StampOf(4)));
    EXPECT_EQ(off_rad < kSameRad, searches) << off_rad;
  }
}

TEST_F(TrackerTest, IsLostInAnEmptyScanAndRecovers) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 4);
  const TrackResult lost = tracker.Track(EmptyScan(4), &map_);
  EXPECT_EQ(lost.state, TrackState::kLost);
  EXPECT_FALSE(lost.is_keyframe);
  EXPECT_TRUE(lost.tracked.T_odom_sensor.IsFinite());
  ExpectAt(tracker.Track(ScanOf(Drive, 5), &map_), Drive(StampOf(5)));
}

TEST_F(TrackerTest, IsLostInGarbageAndRecovers) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 4);
  for (int k = 4; k < 6; ++k) {
    const TrackResult lost = tracker.Track(GarbageScan(k), &map_);
    EXPECT_EQ(lost.state, TrackState::kLost);
    EXPECT_FALSE(lost.is_keyframe);
    // Velocity is halved with every lost scan: of 30 cm, 7.5 cm are missing after two.
    EXPECT_LT(TranslationError(lost.tracked.T_odom_sensor, Drive(StampOf(k))), 0.1);
  }
  ExpectAt(tracker.Track(ScanOf(Drive, 6), &map_), Drive(StampOf(6)));
}

TEST_F(TrackerTest, IsLostSomewhereElseAndRecovers) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 4);
  const auto elsewhere = [](double) { return MakePose(0.6, 0.5, 0, 0, 0, 0.2); };
  const TrackResult lost = tracker.Track(ScanOf(elsewhere, 4, Corridor()), &map_);
  EXPECT_EQ(lost.state, TrackState::kLost);
  EXPECT_FALSE(lost.is_keyframe);
  EXPECT_LT(TranslationError(lost.tracked.T_odom_sensor, Drive(StampOf(4))), kPredictedM);
  ExpectAt(tracker.Track(ScanOf(Drive, 5), &map_), Drive(StampOf(5)));
}

TEST_F(TrackerTest, IsLostWithoutATarget) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 4);
  EXPECT_EQ(tracker.Track(ScanOf(Drive, 4), nullptr).state, TrackState::kLost);
  const RegistrationTarget empty;
  EXPECT_EQ(tracker.Track(ScanOf(Drive, 5), &empty).state, TrackState::kLost);
}

TEST_F(TrackerTest, DoesNotBelieveInImpossibleSpeeds) {
  TrackerConfig config;
  config.recovery.max_speed_mps = 1.0;
  Tracker tracker(config, pool_);
  tracker.Track(ScanOf(Drive, 0), nullptr);
  EXPECT_EQ(tracker.Track(ScanOf(Drive, 1), nullptr).state, TrackState::kLost);
}

// As from one floor of a building to the next, which looks the same.
TEST_F(TrackerTest, DoesNotBelieveInImpossibleAccelerations) {
  const Motion jumps = JumpAt(4, MakePose(0, 0, 0, 0.5, 0.6, 0));
  TrackerConfig credulous;
  credulous.recovery.max_acceleration_mps2 = 1e5;
  for (const bool believes : {false, true}) {
    Tracker tracker(believes ? credulous : TrackerConfig{}, pool_);
    TrackFirst(tracker, jumps, 4);
    const TrackResult result = tracker.Track(InstantScanOf(jumps, 4), &map_);
    EXPECT_EQ(result.state == TrackState::kTracking, believes);
    ExpectAt(tracker.Track(ScanOf(jumps, 5), &map_), jumps(StampOf(5)));
  }
}

TEST_F(TrackerTest, WaitsForAFirstScanWithPoints) {
  Tracker tracker({}, pool_);
  EXPECT_EQ(tracker.Track(EmptyScan(0), nullptr).state, TrackState::kInitializing);
  EXPECT_FALSE(tracker.TakePendingFirst());
  EXPECT_EQ(tracker.Track(ScanOf(Still, 1), nullptr).state, TrackState::kInitializing);
  const TrackResult second = tracker.Track(ScanOf(Still, 2), nullptr);
  ExpectAt(second, SE3());
  ASSERT_TRUE(second.first);
  EXPECT_EQ(second.first->scan, 1);
}

TEST_F(TrackerTest, HandsOutTheOnlyScanOfARecordingOnce) {
  Tracker tracker({}, pool_);
  const Scan scan = ScanOf(Still, 0);
  tracker.Track(scan, nullptr);
  const std::optional<TrackedScan> only = tracker.TakePendingFirst();
  ASSERT_TRUE(only);
  EXPECT_EQ(only->points.size(), scan.points.size());
  EXPECT_FALSE(tracker.TakePendingFirst());
}

TEST_F(TrackerTest, CountsPointsItCannotUseAndIsNotHarmedByThem) {
  Tracker tracker({}, pool_);
  TrackFirst(tracker, Drive, 3);
  Scan scan = ScanOf(Drive, 3);
  std::size_t broken = 0;
  for (std::size_t i = 0; i < scan.points.size(); i += 10) {
    scan.points[i][static_cast<int>(i / 10 % 3)] = std::numeric_limits<float>::quiet_NaN();
    ++broken;
  }
  scan.time_offset_s[5] = std::numeric_limits<float>::quiet_NaN();
  scan.points.emplace_back(0.1f, 0.0f, 0.0f);  // nearer than 0.5 m
  scan.time_offset_s.push_back(0.0f);
  const TrackResult result = tracker.Track(scan, &map_);
  EXPECT_EQ(result.points, scan.points.size());
  EXPECT_EQ(result.not_finite, broken);
  EXPECT_EQ(result.out_of_range, 1u);
  ExpectAt(result, Drive(StampOf(3)));
}

class KeyframePolicyTest : public TrackerTest {
 protected:
  /// A policy that never wants a keyframe.
  static TrackerConfig Never() {
    TrackerConfig config;
    config.keyframe = {.max_distance_m = 100.0,
                       .max_angle_deg = 360.0,
                       .min_overlap = 0.0,
                       .min_support = 0.0,
                       .max_scans = 100000};
    return config;
  }
  /// Which of the scans after the first became keyframes.
  std::vector<int> Keyframes(const TrackerConfig& config, const Motion& motion, int scans) {
    Tracker tracker(config, pool_);
    std::vector<int> keyframes;
    for (int k = 0; k < scans; ++k) {
      if (tracker.Track(ScanOf(motion, k), &map_).is_keyframe) keyframes.push_back(k);
    }
    return keyframes;
  }
};

using Ordinals = std::vector<int>;

TEST_F(KeyframePolicyTest, WantsNoneWithoutAReason) {
  EXPECT_EQ(Keyframes(Never(), Drive, 6), Ordinals{});
}

TEST_F(KeyframePolicyTest, WantsOneAfterADistance) {
  TrackerConfig config = Never();
  config.keyframe.max_distance_m = 0.4;  // 15 cm per scan
  EXPECT_EQ(Keyframes(config, Drive, 8), (Ordinals{3, 6}));
}

TEST_F(KeyframePolicyTest, WantsFewerWhileSomeWaitToBeMapped) {
  TrackerConfig config = Never();
  config.keyframe.max_distance_m = 0.4;  // 15 cm per scan
  EXPECT_EQ(Keyframes(config, Drive, 14), (Ordinals{3, 6, 12}));
  config.keyframe.busy_factor = 1.0;
  EXPECT_EQ(Keyframes(config, Drive, 14), (Ordinals{3, 6, 9, 12}));
}

TEST_F(KeyframePolicyTest, WantsOneAfterATurn) {
  TrackerConfig config = Never();
  config.keyframe.max_angle_deg = 14.0;  // 5.7 deg per scan
  EXPECT_EQ(Keyframes(config, Turn, 8), (Ordinals{3, 6}));
}

TEST_F(KeyframePolicyTest, WantsOneAfterSoManyScans) {
  TrackerConfig config = Never();
  config.keyframe.max_scans = 3;
  EXPECT_EQ(Keyframes(config, Still, 8), (Ordinals{3, 6}));
}

/// Half a room as the map of a sensor that stands in the middle and has seen all of it before.
class MapEndTest : public KeyframePolicyTest {
 protected:
  MapEndTest() {
    std::vector<TargetSurfel> surfels;
    AppendSurfels(StillCloud(Room(), SE3(), kNoise, 100, pool_), SE3(), surfels);
    std::erase_if(surfels, [](const TargetSurfel& s) { return s.mean.x() <= 0.0f; });
    front_ = RegistrationTarget(surfels, Eigen::Vector3d::Zero(), 1);
  }

  RegistrationTarget front_;
};

TEST_F(MapEndTest, WantsAKeyframeWherePointsAreFarFromTheMapOrFewLieOnIt) {
  TrackerConfig far = Never();
  far.keyframe.min_overlap = 0.8;
  TrackerConfig few = Never();
  few.keyframe.min_support = 0.85;
  for (const TrackerConfig& config : {far, few}) {
    Tracker tracker(config, pool_);
    TrackFirst(tracker, Still, 2);
    const TrackResult inside = tracker.Track(ScanOf(Still, 2), &map_);
    EXPECT_GT(inside.overlap, 0.8);
    EXPECT_GT(inside.support, 0.95);
    EXPECT_FALSE(inside.is_keyframe);
    const TrackResult outside = tracker.Track(ScanOf(Still, 3), &front_);
    ExpectAt(outside, SE3());
    EXPECT_LT(outside.overlap, 0.8);
    EXPECT_LT(outside.support, 0.8);
    EXPECT_TRUE(outside.is_keyframe);
    const TrackResult next = tracker.Track(ScanOf(Still, 4), &front_);
    EXPECT_LT(next.overlap, 0.8);
    EXPECT_EQ(next.keyframes_waiting, 1);
    EXPECT_FALSE(next.is_keyframe) << "the keyframe that would fill the gap is on its way";
  }
}

TEST_F(MapEndTest, MissesNothingThatWasNeverThere) {
  TrackerConfig config = Never();
  config.keyframe.min_support = 0.6;
  Tracker tracker(config, pool_);
  for (int k = 0; k < 5; ++k) {
    const TrackResult result = tracker.Track(ScanOf(Still, k), &front_);
    if (k > 1) {
      EXPECT_LT(result.support, 0.6);
    }
    EXPECT_FALSE(result.is_keyframe);
  }
}

class FollowTest : public TrackerTest {
 protected:
  /// Poses of a drive that starts at 1 s, 100 times a second.
  static Trajectory Given() {
    Trajectory poses;
    for (int i = 100; i <= 200; ++i) poses.push_back({0.01 * i, Offset() * Drive(0.01 * i)});
    return poses;
  }
  static SE3 Offset() { return MakePose(0, 0, 0, -kSpeed, 0, 0); }
  static SE3 Driven(double t) { return Offset() * Drive(t); }
};

TEST_F(FollowTest, TakesPosesAsGivenAndDeskewsByThem) {
  Tracker tracker({}, pool_);
  for (const int k : {11, 12, 13}) {
    const std::optional<TrackResult> result = tracker.Follow(ScanOf(Driven, k), Given(), &map_);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->state, TrackState::kTracking);
    EXPECT_LT(TranslationError(result->tracked.T_odom_sensor, Driven(StampOf(k))), 1e-6);
    EXPECT_LT(MedianMisfit(result->tracked.points, Driven(StampOf(k))), 2.0 * kNoise);
    EXPECT_EQ(result->tracked.squared_distance.size(), result->tracked.surface.size());
    EXPECT_GT(result->overlap, 0.8);
    EXPECT_EQ(result->support, 1.0) << "nothing was registered";
  }
}

TEST_F(FollowTest, StartsWithAKeyframe) {
  Tracker tracker({}, pool_);
  const std::optional<TrackResult> result = tracker.Follow(ScanOf(Driven, 11), Given(), nullptr);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->is_keyframe);
  EXPECT_FALSE(result->first);
  EXPECT_FALSE(tracker.TakePendingFirst());
}

TEST_F(FollowTest, SkipsScansWithoutAPose) {
  Tracker tracker({}, pool_);
  EXPECT_FALSE(tracker.Follow(ScanOf(Driven, 9), Given(), nullptr));
  EXPECT_FALSE(tracker.Follow(ScanOf(Driven, 21), Given(), nullptr));
  EXPECT_TRUE(tracker.Follow(ScanOf(Driven, 15), Given(), nullptr));
}

}  // namespace
}  // namespace covsplat::test
