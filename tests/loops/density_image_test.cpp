#include "covsplat/loops/density_image.hpp"

#include <cstdio>

#include "tests/loops/block_city.hpp"
#include <gtest/gtest.h>

#include "covsplat/loops/ground.hpp"

namespace covsplat::test {
namespace {

TEST(AlignWithGround, FindsTheTiltAndTheHeight) {
  Rng rng(1);
  std::vector<Eigen::Vector3f> points;
  const SE3 T_local_ground = MakePose(0.12, -0.2, 0.4, 1.0, 2.0, -1.3);
  for (int i = 0; i < 20000; ++i) {
    Eigen::Vector3d p(rng.Uniform(-40, 40), rng.Uniform(-40, 40), 0.01 * rng.Normal());
    if (i % 3 == 0) p.z() += rng.Uniform(0.0, 8.0);  // what stands on it
    points.push_back((T_local_ground * p).cast<float>());
  }
  const SE3 T_ground_local = AlignWithGround(points);
  const SE3 T_ground_ground = T_ground_local * T_local_ground;
  const Eigen::Vector3d up = T_ground_ground.Rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_LT(std::acos(up.z()), 0.002);
  // The lowest of many noisy points is a little low.
  EXPECT_NEAR(T_ground_ground.Translation().z(), 0.0, 0.04);
}

TEST(AlignWithGround, OfNothingIsNothing) {
  EXPECT_EQ(AlignWithGround({}).Translation(), Eigen::Vector3d::Zero());
}

TEST(DensityImage, IsBrightWhereMostStands) {
  const std::vector<Eigen::Vector3f> points = {{-1.2f, 3.1f, 0.0f},
                                               {-1.3f, 3.2f, 0.5f},
                                               {-1.1f, 3.3f, 1.0f},
                                               {-1.2f, 3.1f, 1.5f},
                                               {4.1f, -2.0f, 0.0f}};
  const DensityImage image = DensityOf(points, 0.5, 0.05);
  EXPECT_EQ(image.origin, Eigen::Vector2i(-3, -4));
  EXPECT_EQ(image.pixels.Rows(), 12);
  EXPECT_EQ(image.pixels.Columns(), 11);
  EXPECT_EQ(image.pixels(0, 10), 255);
  EXPECT_EQ(image.pixels(11, 0), 63);
  EXPECT_EQ(DensityOf(points, 0.5, 0.3).pixels(11, 0), 0);
  EXPECT_TRUE(LandmarksOf(DensityOf({}, 0.5, 0.05)).empty());
}

std::vector<Landmark> Noise(std::size_t count, Rng& rng) {
  std::vector<Landmark> landmarks(count);
  for (Landmark& landmark : landmarks) {
    landmark.position_m = Eigen::Vector2d(rng.Uniform(-50, 50), rng.Uniform(-50, 50)).cast<float>();
    for (std::uint64_t& word : landmark.bits) word = rng.NextU64();
  }
  return landmarks;
}

TEST(MatchLandmarks, FindsTheMotionAmongFalsePairs) {
  Rng rng(2);
  const std::vector<Landmark> old = Noise(100, rng);
  std::vector<Landmark> fresh = Noise(60, rng);
  const Eigen::Rotation2Df turn(2.5f);
  for (std::size_t i = 0; i < 30; ++i) {
    Landmark seen_again = old[i];
    seen_again.position_m = turn.inverse() * (old[i].position_m - Eigen::Vector2f(7.0f, -3.0f));
    seen_again.bits[0] ^= rng.Below(1 << 20);  // looks a little different
    fresh.push_back(seen_again);
  }
  for (std::size_t i = 30; i < 60; ++i) fresh[i - 30].bits = old[i].bits;  // elsewhere
  const PlaneMotion motion = MatchLandmarks(fresh, old, 50, 1.5);
  EXPECT_GE(motion.inliers, 30);
  EXPECT_NEAR(motion.turn_rad, 2.5, 0.01);
  EXPECT_LT((motion.translation_m - Eigen::Vector2d(7.0, -3.0)).norm(), 0.2);
  EXPECT_LE(MatchLandmarks(fresh, Noise(100, rng), 50, 1.5).inliers, 2);
  EXPECT_EQ(MatchLandmarks({}, old, 50, 1.5).inliers, 0);
}

/// Points of a stretch of the way in the frame of one pose of it.
std::vector<Eigen::Vector3f> Stretch(const RayScene& scene,
                                     double from_m,
                                     double to_m,
                                     double turn_rad,
                                     const SE3& T_map_local,
                                     int seed) {
  ThreadPool pool(2);
  std::vector<Place> places;
  LocalMap map;
  for (double way_m = from_m; way_m <= to_m; way_m += 2.0) {
    const SE3 pose = RoundTheBlock(way_m) * MakePose(0.0, 0.0, turn_rad, 0.0, 0.0, 0.0);
    places.push_back(
        PlaceAt(scene, 0, pose, static_cast<std::uint64_t>(seed) + places.size(), pool));
  }
  double way_m = from_m;
  for (const Place& place : places) {
    const SE3 pose = RoundTheBlock(way_m) * MakePose(0.0, 0.0, turn_rad, 0.0, 0.0, 0.0);
    map.push_back({&place, T_map_local.Inverse() * pose});
    way_m += 2.0;
  }
  return PointsOf(map, 0.5);
}

TEST(DensityImage, APlaceIsKnownAgainFromTheOtherDirection) {
  const RayScene city = BlockCity();
  const SE3 T_map_old = RoundTheBlock(30.0);
  const SE3 T_map_fresh =
      RoundTheBlock(35.0) *
      MakePose(0.05, -0.03, M_PI, 0.0, 3.0, 0.0);  // tilted, turned round, aside
  const auto old = Stretch(city, 5.0, 60.0, 0.0, T_map_old, 100);
  const auto fresh = Stretch(city, 10.0, 55.0, M_PI, T_map_fresh, 200);
  const auto landmarks_of = [](std::vector<Eigen::Vector3f> points, const SE3& T_ground_local) {
    for (Eigen::Vector3f& p : points) p = (T_ground_local * p.cast<double>()).cast<float>();
    return LandmarksOf(DensityOf(points, 0.5, 0.05));
  };
  const SE3 T_ground_old = AlignWithGround(old);
  const SE3 T_ground_fresh = AlignWithGround(fresh);
  const auto old_landmarks = landmarks_of(old, T_ground_old);
  const auto fresh_landmarks = landmarks_of(fresh, T_ground_fresh);
  const PlaneMotion motion = MatchLandmarks(fresh_landmarks, old_landmarks, 50, 1.5);
  const SE3 found = T_ground_old.Inverse() * motion.InSpace() * T_ground_fresh;
  const SE3 truth = T_map_old.Inverse() * T_map_fresh;
  std::printf("%zu and %zu landmarks, %d inliers, off %.2f m, %.3f rad\n",
              old_landmarks.size(),
              fresh_landmarks.size(),
              motion.inliers,
              TranslationError(found, truth),
              RotationError(found, truth));
  EXPECT_GE(motion.inliers, 8);
  EXPECT_LT(TranslationError(found, truth), 1.0);
  EXPECT_LT(RotationError(found, truth), 0.05);
}

}  // namespace
}  // namespace covsplat::test
