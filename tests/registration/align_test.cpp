#include <algorithm>
#include <cmath>

#include "tests/support/walk.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

const SE3 kTruth = MakePose(0.02, -0.03, 0.06, 0.25, -0.15, 0.08);

RegistrationTarget TargetFrom(const SourceCloud& cloud, float weight = 1.0f) {
  std::vector<TargetSurfel> surfels;
  AppendSurfels(cloud, SE3(), surfels);
  for (TargetSurfel& surfel : surfels) surfel.weight = weight;
  return RegistrationTarget(surfels, Eigen::Vector3d::Zero(), 1);
}

GicpConfig Precise() {
  GicpConfig config;
  config.rotation_epsilon_rad = config.translation_epsilon_m = 1e-10;
  config.max_iterations = 100;
  return config;
}

// The same cloud seen from elsewhere: corresponds point by point.
SourceCloud Moved(SourceCloud cloud, const SE3& T_new_old) {
  for (std::size_t i = 0; i < cloud.Size(); ++i) {
    cloud.points[i] = (T_new_old * cloud.points[i].cast<double>()).cast<float>();
    cloud.covariance[i].axes = T_new_old.RotationMatrix().cast<float>() * cloud.covariance[i].axes;
  }
  return cloud;
}

TEST(Align, FindsTheExactMotionOfTheSamePoints) {
  ThreadPool pool(2);
  const SourceCloud cloud = StillCloud(Room(), SE3(), 0.0, 1, pool);
  const AlignResult result =
      Align(Moved(cloud, kTruth.Inverse()), TargetFrom(cloud), At(SE3()), Precise(), pool);
  EXPECT_LT(RotationError(result.motion.T_map_sensor, kTruth), 1e-6);
  EXPECT_LT(TranslationError(result.motion.T_map_sensor, kTruth), 1e-6);
  EXPECT_EQ(result.degenerate_directions, 0);
  EXPECT_EQ(result.correspondences, cloud.Size());
  EXPECT_DOUBLE_EQ(result.inlier_ratio, 1.0);
}

TEST(Align, FindsTheMotionBetweenNoisyScansToMillimetres) {
  ThreadPool pool(2);
  const RegistrationTarget target = TargetFrom(StillCloud(Room(), SE3(), 0.02, 1, pool));
  const SourceCloud source = StillCloud(Room(), kTruth, 0.02, 2, pool);
  const AlignResult result = Align(source, target, At(SE3()), GicpConfig{}, pool);
  std::printf("2 cm noise: %.2f mm, %.3f mrad, rms %.1f mm, inliers %.3f, %d iterations\n",
              1e3 * TranslationError(result.motion.T_map_sensor, kTruth),
              1e3 * RotationError(result.motion.T_map_sensor, kTruth),
              1e3 * result.rms_residual_m,
              result.inlier_ratio,
              result.iterations);
  EXPECT_TRUE(result.converged);
  EXPECT_LT(TranslationError(result.motion.T_map_sensor, kTruth), 0.005);
  EXPECT_LT(RotationError(result.motion.T_map_sensor, kTruth), 1e-3);
  EXPECT_EQ(result.degenerate_directions, 0);
  EXPECT_GT(result.inlier_ratio, 0.9);
}

// Of a few scans there are points that change their matches in turns, for ever.
TEST(Align, EndsWhereStepsGoRoundInCircles) {
  ThreadPool pool(2);
  const SensorModel sensor = UniformSensorModel(32, 512, -0.25 * M_PI, 0.25 * M_PI, 0.5, 60.0);
  const RegistrationTarget target(RoomSurfels(sensor, pool), Eigen::Vector3d::Zero(), 1);
  for (std::uint64_t k = 0; k < 140; ++k) {
    const double stamp_s = 1.0 + 0.05 * static_cast<double>(k);
    const Scan scan = Simulate(Room(), sensor, HandheldWalk, stamp_s, 0.05, 100 + k);
    const MotionPrediction prediction = WalkPrediction(stamp_s);
    const SourceCloud source =
        Preprocess(scan, TimeScan(scan, DeskewConfig{}), prediction.motion, Fine(), pool);
    const AlignResult result = Align(source, target, prediction, GicpConfig{}, pool);
    EXPECT_TRUE(result.converged) << k;
    EXPECT_LT(result.iterations, 40) << k;
  }
}

TEST(Align, DoesNotDependOnTheScaleOfTheWeights) {
  ThreadPool pool(2);
  const SourceCloud cloud = StillCloud(Room(), SE3(), 0.02, 1, pool);
  const SourceCloud source = StillCloud(Room(), kTruth, 0.02, 2, pool);
  const AlignResult one = Align(source, TargetFrom(cloud), At(SE3()), GicpConfig{}, pool);
  const AlignResult other = Align(source, TargetFrom(cloud, 8.0f), At(SE3()), GicpConfig{}, pool);
  EXPECT_LT(RotationError(one.motion.T_map_sensor, other.motion.T_map_sensor), 1e-9);
  EXPECT_LT(TranslationError(one.motion.T_map_sensor, other.motion.T_map_sensor), 1e-9);
  EXPECT_NEAR(one.information(4, 4) / other.information(4, 4), 1.0, 1e-5);
}

TEST(Align, ReportsTheDirectionAlongACorridorAndKeepsItsPrediction) {
  ThreadPool pool(2);
  for (const double noise : {0.0, 0.02}) {
    const SE3 truth = MakePose(0.0, 0.01, 0.03, 0.3, 0.05, -0.02);
    const RegistrationTarget target = TargetFrom(StillCloud(Corridor(), SE3(), noise, 1, pool));
    const SourceCloud source = StillCloud(Corridor(), truth, noise, 2, pool);
    const AlignResult result = Align(source, target, At(SE3()), GicpConfig{}, pool);
    ASSERT_EQ(result.weak.translations.size(), 1u) << noise;
    EXPECT_TRUE(result.weak.rotations.empty()) << noise;
    const Eigen::Vector3d along = truth.Rotation() * result.weak.translations[0];
    EXPECT_GT(std::abs(along.x()), 0.999) << noise;
    EXPECT_NEAR(result.motion.T_map_sensor.Translation().x(), 0.0, 0.005) << noise;
    EXPECT_NEAR(result.motion.T_map_sensor.Translation().y(), 0.05, 0.005) << noise;
    EXPECT_LT(RotationError(result.motion.T_map_sensor, truth), 2e-3) << noise;
  }
}

TEST(Align, ReportsTwoTranslationsAndTheTurnAboveASinglePlane) {
  ThreadPool pool(2);
  for (const double noise : {0.0, 0.02}) {
    const SE3 truth = MakePose(0.01, -0.01, 0.0, 0.0, 0.0, 0.05);
    const RegistrationTarget target = TargetFrom(StillCloud(Floor(), SE3(), noise, 1, pool));
    const SourceCloud source = StillCloud(Floor(), truth, noise, 2, pool);
    const AlignResult result = Align(source, target, At(SE3()), GicpConfig{}, pool);
    ASSERT_EQ(result.weak.translations.size(), 2u) << noise;
    ASSERT_EQ(result.weak.rotations.size(), 1u) << noise;
    EXPECT_GT(std::abs(result.weak.rotations[0].z()), 0.99) << noise;
    EXPECT_NEAR(result.motion.T_map_sensor.Translation().z(), 0.05, 0.003) << noise;
  }
}

TEST(Align, IsTheSameToTheBitForAnyNumberOfThreads) {
  ThreadPool one(1);
  const RegistrationTarget target = TargetFrom(StillCloud(Room(), SE3(), 0.02, 1, one));
  const Scan scan = Simulate(Room(), SimulatedSensor(), HandheldWalk, 1.0, 0.02);
  const MotionPrediction prediction{{.T_map_sensor = HandheldWalk(1.0)}, 10.0};
  const auto run = [&](int threads) {
    ThreadPool pool(threads);
    const ScanTiming timing = TimeScan(scan, DeskewConfig{});
    const SourceCloud source =
        Preprocess(scan, timing, prediction.motion, PreprocessConfig{}, pool);
    return Align(source, target, prediction, GicpConfig{}, pool);
  };
  const AlignResult reference = run(1);
  for (const int threads : {2, 5}) {
    const AlignResult result = run(threads);
    EXPECT_EQ(result.motion.T_map_sensor.Matrix(), reference.motion.T_map_sensor.Matrix());
    EXPECT_EQ(result.motion.twist, reference.motion.twist);
    EXPECT_EQ(result.motion.acceleration, reference.motion.acceleration);
    EXPECT_EQ(result.information, reference.information);
    EXPECT_EQ(result.squared_distance, reference.squared_distance);
  }
}

TEST(Align, CannotTellTheMapsOriginFromTheRest) {
  ThreadPool pool(2);
  const SourceCloud cloud = StillCloud(Room(), SE3(), 0.02, 1, pool);
  std::vector<TargetSurfel> surfels;
  AppendSurfels(cloud, SE3(), surfels);
  const Eigen::Vector3d far(12345.0, -54321.0, 321.0);
  const SE3 shift(Eigen::Quaterniond::Identity(), far);
  const SourceCloud source = StillCloud(Room(), kTruth, 0.02, 2, pool);
  const AlignResult near_result =
      Align(source, RegistrationTarget(surfels, Eigen::Vector3d::Zero(), 1), At(SE3()), {}, pool);
  const AlignResult far_result =
      Align(source, RegistrationTarget(surfels, far, 1), At(shift), {}, pool);
  EXPECT_LT(
      TranslationError(far_result.motion.T_map_sensor, shift * near_result.motion.T_map_sensor),
      1e-8);
}

TEST(Align, ReturnsThePredictionWithoutMatches) {
  ThreadPool pool(2);
  const SourceCloud cloud = StillCloud(Room(), SE3(), 0.02, 1, pool);
  const RegistrationTarget target = TargetFrom(cloud);
  SE3 nowhere = MakePose(0, 0, 0, 1e6, 0, 0);
  for (const auto& [source, map, pose] : {std::tuple(SourceCloud{}, target, kTruth),
                                          std::tuple(cloud, RegistrationTarget(), kTruth),
                                          std::tuple(SourceCloud{}, RegistrationTarget(), kTruth),
                                          std::tuple(cloud, target, nowhere)}) {
    const AlignResult result = Align(source, map, At(pose), GicpConfig{}, pool);
    EXPECT_EQ(result.motion.T_map_sensor.Matrix(), pose.Matrix());
    EXPECT_FALSE(result.converged);
    EXPECT_EQ(result.correspondences, 0u);
    EXPECT_EQ(result.inlier_ratio, 0.0);
    EXPECT_EQ(result.squared_distance.size(), source.Size());
    EXPECT_TRUE(std::all_of(result.squared_distance.begin(),
                            result.squared_distance.end(),
                            [](float d) { return std::isinf(d); }));
  }
}

TEST(Align, SurvivesAPredictionThatIsNotFinite) {
  ThreadPool pool(1);
  const SourceCloud cloud = StillCloud(Room(), SE3(), 0.02, 1, pool);
  MotionPrediction broken;
  broken.motion.twist[3] = std::nan("");
  const AlignResult result = Align(cloud, TargetFrom(cloud), broken, GicpConfig{}, pool);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.correspondences, 0u);
}

TEST(Align, IgnoresWhatWasNotThereBefore) {
  ThreadPool pool(2);
  const RegistrationTarget target = TargetFrom(StillCloud(Room(), SE3(), 0.02, 1, pool));
  SourceCloud source = StillCloud(Room(), kTruth, 0.02, 2, pool);
  Rng rng(3);
  for (std::size_t i = 0; i < source.Size(); i += 4) {  // a quarter is up to 0.5 m too near
    source.points[i] *= 1.0f - 0.5f * static_cast<float>(rng.Uniform()) / source.points[i].norm();
  }
  const AlignResult result = Align(source, target, At(SE3()), GicpConfig{}, pool);
  EXPECT_LT(TranslationError(result.motion.T_map_sensor, kTruth), 0.01);
  EXPECT_LT(RotationError(result.motion.T_map_sensor, kTruth), 1e-3);
}

// A scan of the storey above a map of the one below: the floor is the ceiling's other side.
TEST(Align, TheTwoSidesOfAFloorAreNotOneSurface) {
  ThreadPool pool(2);
  const RayScene below({{{-1e4, -1e4, -1.5}, {1e4, 1e4, 1.5}}});
  const RayScene above({{{-1e4, -1e4, 1.75}, {1e4, 1e4, 4.75}}});
  const SE3 pose = MakePose(0.0, 0.0, 0.0, 0.0, 0.0, 3.25);
  const RegistrationTarget target = TargetFrom(StillCloud(below, SE3(), 0.01, 1, pool));
  const SourceCloud source = StillCloud(above, pose, 0.01, 2, pool);
  GicpConfig config;
  const AlignResult apart = Align(source, target, At(pose), config, pool);
  config.same_side = false;
  const AlignResult joined = Align(source, target, At(pose), config, pool);
  EXPECT_LT(apart.inlier_ratio, 0.05);
  EXPECT_GT(joined.inlier_ratio, 0.3);
  EXPECT_GT(TranslationError(joined.motion.T_map_sensor, pose), 0.2);  // drawn to the ceiling
}

}  // namespace
}  // namespace covsplat::test
