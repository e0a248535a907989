#include "covsplat/mapping/reliability.hpp"

#include <cmath>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

class FreeSpaceTest : public ::testing::Test {
 protected:
  static constexpr int kRemembered = 4;

  bool HasMoved(const FreeSpace& space, const Eigen::Vector3f& point, const SE3& pose = SE3()) {
    return space.FindMoved(std::vector<Eigen::Vector3f>{point}, pose, pool_)[0] != 0;
  }
  FreeSpace Make(bool enabled = true) const {
    return {ReducedSensor(), {.enabled = enabled, .keyframes = kRemembered, .min_seen_through = 2}};
  }

  ThreadPool pool_{2};
};

TEST_F(FreeSpaceTest, NothingHasMovedBeforeAnythingWasSeen) {
  EXPECT_FALSE(HasMoved(Make(), {5, 0, 0}));
}

TEST_F(FreeSpaceTest, WhatStandsWhereSeveralKeyframesSawThroughHasMoved) {
  FreeSpace space = Make();
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  EXPECT_FALSE(HasMoved(space, {5, 0, 0})) << "one may be wrong";
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  EXPECT_TRUE(HasMoved(space, {5, 0, 0}));
  EXPECT_FALSE(HasMoved(space, {8.1f, 0, 0})) << "what they saw";
  EXPECT_FALSE(HasMoved(space, {12, 0, 0})) << "hidden behind it";
  EXPECT_FALSE(HasMoved(space, {0.1f, 0, 5})) << "nobody looked there";
}

TEST_F(FreeSpaceTest, PlacesAreThoseOfTheMapWhereverTheSensorHasBeen) {
  FreeSpace space = Make();
  const SE3 then = MakePose(0, 0, 0.5, 100, -40, 1);
  space.Remember(SphereKeyframe(then, 8.0f));
  space.Remember(SphereKeyframe(then, 8.0f));
  const SE3 now = then * MakePose(0, 0, 1.0, 2, 0, 0);
  const SE3 T_now_then = now.Inverse() * then;
  const auto seen_now = [&](double x_then) {
    return Eigen::Vector3f((T_now_then * Eigen::Vector3d(x_then, 0, 0)).cast<float>());
  };
  EXPECT_TRUE(HasMoved(space, seen_now(5.0), now));
  EXPECT_FALSE(HasMoved(space, seen_now(8.0), now));
}

TEST_F(FreeSpaceTest, WhatMoreKeyframesHaveSeenThanSeenThroughStays) {
  FreeSpace space = Make();
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  space.Remember(SphereKeyframe(SE3(), 5.0f));
  EXPECT_TRUE(HasMoved(space, {5, 0, 0}));
  space.Remember(SphereKeyframe(SE3(), 5.0f));
  EXPECT_FALSE(HasMoved(space, {5, 0, 0})) << "two against two: a thin thing, or one that rests";
}

TEST_F(FreeSpaceTest, KeyframesAreForgotten) {
  FreeSpace space = Make();
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  for (int k = 1; k < kRemembered; ++k) space.Remember(SphereKeyframe(SE3(), 0.0f));
  EXPECT_FALSE(HasMoved(space, {5, 0, 0}));
}

TEST_F(FreeSpaceTest, SwitchedOffNothingMoves) {
  FreeSpace space = Make(false);
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  space.Remember(SphereKeyframe(SE3(), 8.0f));
  EXPECT_FALSE(HasMoved(space, {5, 0, 0}));
}

TEST(MaskSurfaces, MakesPixelsAsIfNothingHadReturned) {
  ThreadPool pool(2);
  Keyframe keyframe = StillKeyframe(Room(), ReducedSensor(), SE3(), 0.01, 1, pool);
  const Keyframe before = keyframe;
  std::vector<std::uint8_t> masked(keyframe.tracked.surface.size(), 0);
  for (std::size_t i = 0; i < masked.size(); i += 3) masked[i] = 1;
  MaskSurfaces(masked, keyframe);
  std::size_t gone = 0;
  for (std::size_t i = 0; i < keyframe.point.Size(); ++i) {
    const int surface = before.surface.Pixels()[i];
    const bool was_masked = surface >= 0 && masked[static_cast<std::size_t>(surface)] != 0;
    gone += was_masked;
    const float range_m = before.measurement.range_m.Pixels()[i];
    EXPECT_EQ(keyframe.measurement.range_m.Pixels()[i], was_masked ? 0.0f : range_m);
    EXPECT_EQ(keyframe.point.Pixels()[i], was_masked ? -1 : before.point.Pixels()[i]);
    EXPECT_EQ(keyframe.surface.Pixels()[i], was_masked ? -1 : surface);
    if (!was_masked) continue;
    EXPECT_EQ(keyframe.measurement.normal.Pixels()[i], Eigen::Vector3f::Zero());
  }
  EXPECT_GT(gone, 1000u);
}

}  // namespace
}  // namespace covsplat::test
