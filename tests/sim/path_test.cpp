#include "covsplat/sim/path.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

constexpr double kRadiusM = 6.0;
constexpr double kQuarterM = 1.5707963 * kRadiusM;

TEST(PathTest, AnOpenWayAlongStreetsTurnsToBothSidesAndEndsWhereItSays) {
  const Path path(
      AlongStreets({{0.0, 0.0}, {50.0, 0.0}, {50.0, 40.0}, {90.0, 40.0}}, false, kRadiusM, 1.0),
      false);
  EXPECT_LT((path.At(0.0) - Eigen::Vector3d(0.0, 0.0, 0.0)).norm(), 1e-9);
  EXPECT_LT((path.At(path.Length()) - Eigen::Vector3d(90.0, 40.0, 0.0)).norm(), 1e-9);
  EXPECT_NEAR(path.Length(), 130.0 - 4.0 * kRadiusM + 2.0 * kQuarterM, 0.3);
  // The first turn goes left, the second one right.
  EXPECT_NEAR(path.Heading(70.0), 1.5708, 0.01);
  EXPECT_NEAR(path.Heading(110.0), 0.0, 0.01);
  for (double at = 1.0; at < path.Length() - 1.0; at += 0.5) {
    EXPECT_LT(path.Curvature(at), 1.1 / kRadiusM) << at;
  }
}

TEST(PathTest, AClosedWayRoundABlockHasFourTurnsOfOneKind) {
  const Path path(
      AlongStreets({{0.0, 0.0}, {50.0, 0.0}, {50.0, 40.0}, {0.0, 40.0}}, true, kRadiusM, 1.0),
      true);
  EXPECT_NEAR(path.Length(), 180.0 - 8.0 * kRadiusM + 4.0 * kQuarterM, 0.3);
  EXPECT_LT((path.At(path.Length()) - path.At(0.0)).norm(), 1e-9);
  for (double at = 0.0; at < path.Length(); at += 0.5) {
    const double turn = path.Heading(at + 0.5) - path.Heading(at);
    EXPECT_GT(std::remainder(turn, 2.0 * 3.14159265), -0.01) << "counter-clockwise, at " << at;
  }
}

}  // namespace
}  // namespace covsplat
