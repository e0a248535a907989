#include "covsplat/loops/loop_check.hpp"

#include <cstdio>

#include "tests/loops/block_city.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

TEST(Sight, TellsWhatItSeesFromWhatItSeesThroughAndWhatIsHidden) {
  std::vector<Eigen::Vector3f> wall;
  for (float y = -5.0f; y <= 5.0f; y += 0.05f) {
    for (float z = -2.0f; z <= 2.0f; z += 0.05f) wall.emplace_back(10.0f, y, z);
  }
  const Sight sight(wall);
  EXPECT_EQ(sight.See({10.0f, 0.0f, 0.0f}), Seen::kThere);
  EXPECT_EQ(sight.See({9.8f, 3.0f, 1.0f}), Seen::kThere);
  EXPECT_EQ(sight.See({5.0f, 0.0f, 0.0f}), Seen::kThrough);
  EXPECT_EQ(sight.See({15.0f, 0.0f, 0.0f}), Seen::kUnknown);   // behind it
  EXPECT_EQ(sight.See({-10.0f, 0.0f, 0.0f}), Seen::kUnknown);  // nothing came from there
  EXPECT_EQ(sight.See({0.0f, 0.0f, 0.0f}), Seen::kUnknown);
  EXPECT_EQ(sight.See(Eigen::Vector3f::Constant(NAN)), Seen::kUnknown);
  EXPECT_EQ(Sight().See({1.0f, 0.0f, 0.0f}), Seen::kUnknown);
}

TEST(Place, KeepsOnePointPerCubeAndKnowsWhichAreFlat) {
  const std::vector<Eigen::Vector3f> surface = {{1.1f, 0.1f, 0.1f},
                                                {1.2f, 0.2f, 0.2f},
                                                {1.6f, 0.1f, 0.1f},
                                                {3.0f, 0.0f, 0.0f},
                                                {5.0f, 0.0f, 0.0f}};
  std::vector<PointCovariance> covariance(5);
  for (PointCovariance& c : covariance) c.sigma_m = {0.3f, 0.2f, 0.01f};
  covariance[3].sigma_m = {0.3f, 0.01f, 0.0f};  // a line
  covariance[4].sigma_m = {0.3f, 0.3f, 0.2f};   // a bush
  const Place place = MakePlace(4, surface, surface, covariance, 0.5);
  EXPECT_EQ(place.keyframe, 4);
  ASSERT_EQ(place.points.size(), 4u);
  EXPECT_LT((place.points[1].Position() - surface[2]).cwiseAbs().maxCoeff(),
            0.51f * PlacePoint::kStepM);
  EXPECT_EQ(place.points[1].Normal(), Eigen::Vector3f::UnitZ());
  EXPECT_TRUE(place.points[1].IsFlat());
  EXPECT_FALSE(place.points[2].IsFlat());
  EXPECT_FALSE(place.points[3].IsFlat());
  EXPECT_EQ(PointsOf({{&place, SE3()}}, 0.5).size(), 4u);
  EXPECT_EQ(SourceOf({{&place, SE3()}}, 0.5).Size(), 2u);
  EXPECT_EQ(TargetOf({{&place, SE3()}}, 0.5).Size(), 2u);
}

class LoopCheckTest : public ::testing::Test {
 protected:
  /// Places every 2 m of a stretch of the way, as seen on a lap of their own.
  std::vector<Place> Stretch(double from_m, double to_m, std::uint64_t seed) {
    std::vector<Place> places;
    for (double way_m = from_m; way_m <= to_m; way_m += 2.0) {
      const auto number = static_cast<int>(places.size());
      places.push_back(PlaceAt(city_, number, RoundTheBlock(way_m), seed + places.size(), pool_));
    }
    return places;
  }

  /// In the frame of the place at `origin_m`.
  static LocalMap MapOf(const std::vector<Place>& places, double from_m, double origin_m) {
    LocalMap map;
    double way_m = from_m;
    for (const Place& place : places) {
      map.push_back({&place, RoundTheBlock(origin_m).Inverse() * RoundTheBlock(way_m)});
      way_m += 2.0;
    }
    return map;
  }

  ThreadPool pool_{2};
  const RayScene city_ = BlockCity();
};

TEST_F(LoopCheckTest, ThePlaceSeenAgainIsFoundToCentimetresFromAMetreAway) {
  const std::vector<Place> old = Stretch(10.0, 30.0, 100);
  const std::vector<Place> fresh = Stretch(17.0, 23.0, 200);
  const SE3 truth = RoundTheBlock(20.0).Inverse() * RoundTheBlock(23.0);
  const SE3 guess = truth * MakePose(0.01, -0.02, 0.03, 0.7, -0.6, 0.3);
  const LoopCheck check =
      CheckLoop(MapOf(fresh, 17.0, 23.0), MapOf(old, 10.0, 20.0), guess, 1.0, {}, pool_);
  std::printf("overlap %.2f, rms %.3f m, seen through %.3f, off %.4f m, %.5f rad\n",
              check.overlap,
              check.rms_m,
              check.seen_through,
              TranslationError(check.T_old_new, truth),
              RotationError(check.T_old_new, truth));
  EXPECT_EQ(check.fate, LoopFate::kAlone);
  EXPECT_LT(TranslationError(check.T_old_new, truth), 0.02);
  EXPECT_LT(RotationError(check.T_old_new, truth), 2e-3);
  // As sure as the configured deviations allow, in all directions.
  const LoopCheckConfig config;
  const Eigen::Matrix3d covariance = check.information.inverse().bottomRightCorner<3, 3>();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::sqrt(covariance(k, k)), config.sigma_m, 0.005);
}

TEST_F(LoopCheckTest, AnotherCornerThatLooksAlikeIsNoLoop) {
  const std::vector<Place> old = Stretch(10.0, 30.0, 100);
  // The same bend, a side further on.
  const std::vector<Place> fresh = Stretch(67.0, 73.0, 200);
  const SE3 guess = RoundTheBlock(20.0).Inverse() * RoundTheBlock(23.0);
  const LoopCheck check =
      CheckLoop(MapOf(fresh, 67.0, 73.0), MapOf(old, 10.0, 20.0), guess, 2.0, {}, pool_);
  std::printf("overlap %.2f, rms %.3f m, seen through %.3f\n",
              check.overlap,
              check.rms_m,
              check.seen_through);
  EXPECT_NE(check.fate, LoopFate::kAlone);
  EXPECT_GT(check.seen_through, 0.22);
}

TEST_F(LoopCheckTest, AlongACorridorNothingIsKnownAndAnyPlaceWouldDo) {
  const RayScene corridor = Corridor();
  const Place old = PlaceAt(corridor, 0, SE3(), 1, pool_);
  const Place fresh = PlaceAt(corridor, 1, SE3(), 2, pool_);
  const LoopCheck check = CheckLoop(
      {{&fresh, SE3()}}, {{&old, SE3()}}, MakePose(0.0, 0.0, 0.01, 0.4, 0.2, 0.0), 1.0, {}, pool_);
  EXPECT_EQ(check.fate, LoopFate::kDegenerate);
  EXPECT_LT(std::abs(check.T_old_new.Translation().y()), 0.02);
  EXPECT_GT(check.information(4, 4), 1000.0);
  EXPECT_LT(check.information(3, 3), 1.0);
}

// The ceiling of one storey is a hand's breadth below the floor of the next.
TEST_F(LoopCheckTest, TheOtherSideOfAFloorIsAnotherPlace) {
  const RayScene below({{{-8.0, -6.0, -1.5}, {8.0, 6.0, 1.5}}});
  const RayScene above({{{-8.0, -6.0, 1.75}, {8.0, 6.0, 4.75}}});
  const Place old = PlaceAt(below, 0, SE3(), 1, pool_);
  const Place fresh = PlaceAt(above, 1, MakePose(0.0, 0.0, 0.0, 0.0, 0.0, 3.25), 2, pool_);
  const LoopCheck check = CheckLoop(
      {{&fresh, SE3()}}, {{&old, SE3()}}, MakePose(0.0, 0.0, 0.0, 0.0, 0.0, 3.1), 0.6, {}, pool_);
  EXPECT_EQ(check.fate, LoopFate::kLittleOverlap);
  EXPECT_LT(check.overlap, 0.1);
}

TEST_F(LoopCheckTest, NothingMatchesNothing) {
  const Place empty;
  const LoopCheck check = CheckLoop({{&empty, SE3()}}, {{&empty, SE3()}}, SE3(), 1.0, {}, pool_);
  EXPECT_EQ(check.fate, LoopFate::kLittleOverlap);
  EXPECT_EQ(check.information, Matrix6d::Zero());
}

}  // namespace
}  // namespace covsplat::test
