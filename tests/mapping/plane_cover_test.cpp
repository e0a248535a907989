#include "covsplat/mapping/plane_cover.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat::test {
namespace {

constexpr double kExtentFactor = 1.2;
/// Half the side of a Gaussian's square in its scale.
const float kEdge = static_cast<float>(std::numbers::sqrt3 / kExtentFactor);

/// A square, or rectangle, of a plane that is turned in some way: the plane's own axes are x and y.
PlanarGaussian Rectangle(const Eigen::Vector3f& middle,
                         float half_x,
                         float half_y,
                         const Eigen::Quaternionf& turn = Eigen::Quaternionf::Identity(),
                         float opacity = 0.8f) {
  return {{.mean = turn * middle,
           .u = turn * Eigen::Vector3f(half_x / kEdge, 0, 0),
           .v = turn * Eigen::Vector3f(0, half_y / kEdge, 0)},
          opacity};
}

/// Squares with sides of `side` side by side, `columns` x `rows`, around a place.
std::vector<PlanarGaussian> Tiles(int columns,
                                  int rows,
                                  float side,
                                  const Eigen::Vector3f& middle) {
  std::vector<PlanarGaussian> tiles;
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Eigen::Vector3f at(static_cast<float>(i) - 0.5f * static_cast<float>(columns - 1),
                               static_cast<float>(j) - 0.5f * static_cast<float>(rows - 1),
                               0.0f);
      tiles.push_back(Rectangle(middle + side * at, 0.5f * side, 0.5f * side));
    }
  }
  return tiles;
}

/// All in one cell, and as many as there are.
PlaneCoverConfig OneCell() {
  PlaneCoverConfig config;
  config.cell_m = 8.0;
  config.passes = 1;
  config.max_scale_m = 10.0;
  config.fill = 0.9;
  config.max_share = 1.0;
  return config;
}

std::vector<PlaneCover> Cover(const std::vector<PlanarGaussian>& gaussians,
                              const PlaneCoverConfig& config = OneCell()) {
  return CoverPlanes(gaussians, kExtentFactor, config);
}

/// Gaussians after their covers have taken their places.
std::vector<Disc> After(const std::vector<PlanarGaussian>& gaussians,
                        const std::vector<PlaneCover>& covers) {
  std::vector<bool> gone(gaussians.size(), false);
  std::vector<Disc> left;
  for (const PlaneCover& cover : covers) {
    for (const std::size_t i : cover.members) {
      EXPECT_FALSE(gone[i]) << "nothing is covered twice";
      gone[i] = true;
    }
    left.push_back(cover.disc);
  }
  for (std::size_t i = 0; i < gaussians.size(); ++i) {
    if (!gone[i]) left.push_back(gaussians[i].disc);
  }
  return left;
}

bool IsIn(const Disc& disc, const Eigen::Vector3f& p, float margin = 1.1f) {
  const Eigen::Vector3f offset = p - disc.mean;
  const float reach = margin * kEdge;
  return std::abs(offset.dot(disc.u)) <= reach * disc.u.squaredNorm() &&
         std::abs(offset.dot(disc.v)) <= reach * disc.v.squaredNorm() &&
         std::abs(offset.dot(disc.u.cross(disc.v).normalized())) < 0.05f;
}

TEST(CoverPlanes, MakesOneRectangleOfItsHalves) {
  const Eigen::Quaternionf turn = MakePose(0.4, -0.3, 1.2, 0, 0, 0).Rotation().cast<float>();
  const std::vector<PlaneCover> covers =
      Cover({Rectangle({2.9f, 3.0f, 1.0f}, 0.1f, 0.15f, turn, 0.8f),
             Rectangle({3.1f, 3.0f, 1.0f}, 0.1f, 0.15f, turn, 0.8f)});
  ASSERT_EQ(covers.size(), 1u);
  const PlaneCover& cover = covers[0];
  EXPECT_EQ(cover.members, (std::vector<std::size_t>{0, 1}));
  const PlanarGaussian whole = Rectangle({3.0f, 3.0f, 1.0f}, 0.2f, 0.15f, turn);
  EXPECT_LT((cover.disc.mean - whole.disc.mean).norm(), 1e-5f);
  EXPECT_NEAR(std::abs(cover.disc.u.dot(whole.disc.u)), whole.disc.u.squaredNorm(), 1e-6f);
  EXPECT_NEAR(std::abs(cover.disc.v.dot(whole.disc.v)), whole.disc.v.squaredNorm(), 1e-6f);
  EXPECT_GT(cover.disc.u.cross(cover.disc.v).dot(turn * Eigen::Vector3f::UnitZ()), 0.0f);
  EXPECT_NEAR(cover.opacity, 0.8f, 1e-6f);
}

TEST(CoverPlanes, ShowsAsMuchOfItsMembersAsBefore) {
  const auto opacity_of = [](const std::vector<PlanarGaussian>& gaussians) {
    const std::vector<PlaneCover> covers = Cover(gaussians);
    EXPECT_EQ(covers.size(), 1u);
    return covers.empty() ? 0.0f : covers[0].opacity;
  };
  const Eigen::Quaternionf same = Eigen::Quaternionf::Identity();
  // Upon each other they hide more; side by side their light is mixed.
  EXPECT_NEAR(opacity_of({Rectangle({0, 0, 1}, 0.1f, 0.1f, same, 0.5f),
                          Rectangle({0, 0, 1}, 0.1f, 0.1f, same, 0.5f)}),
              0.75f,
              1e-5f);
  EXPECT_NEAR(opacity_of({Rectangle({0, 0, 1}, 0.1f, 0.1f, same, 0.36f),
                          Rectangle({0.2f, 0, 1}, 0.1f, 0.1f, same, 0.84f)}),
              1.0f - std::sqrt(0.64f * 0.16f),
              1e-5f);
}

TEST(CoverPlanes, CoversAWholePlaneAndNothingElse) {
  const std::vector<PlanarGaussian> tiles = Tiles(16, 12, 0.1f, {0.83f, 0.61f, 0.2f});
  PlaneCoverConfig config;
  config.fill = 0.9;
  config.max_share = 1.0;
  const std::vector<Disc> left = After(tiles, Cover(tiles, config));
  EXPECT_LT(left.size(), tiles.size() / 4);
  Rng rng(1);
  int covered = 0;
  constexpr int kPlaces = 2000;
  for (int k = 0; k < kPlaces; ++k) {
    const Eigen::Vector3f p(0.03f + 1.6f * static_cast<float>(rng.Uniform()),
                            0.01f + 1.2f * static_cast<float>(rng.Uniform()),
                            0.2f);
    covered += std::ranges::any_of(left, [&](const Disc& disc) { return IsIn(disc, p); });
  }
  EXPECT_GE(covered, 0.98 * kPlaces);
  for (const Disc& disc : left) {  // within what there was
    const Eigen::Vector3f reach = kEdge * (disc.u.cwiseAbs() + disc.v.cwiseAbs());
    EXPECT_GT(disc.mean.x() - reach.x(), 0.03f - 0.06f);
    EXPECT_LT(disc.mean.x() + reach.x(), 1.63f + 0.06f);
    EXPECT_GT(disc.mean.y() - reach.y(), 0.01f - 0.06f);
    EXPECT_LT(disc.mean.y() + reach.y(), 1.21f + 0.06f);
  }
}

TEST(CoverPlanes, NeverJoinsWhatIsNotOnePlane) {
  const PlanarGaussian here = Rectangle({0, 0, 1}, 0.3f, 0.3f);
  const auto apart = [&](const PlanarGaussian& other) { return Cover({here, other}).empty(); };
  EXPECT_TRUE(apart(Rectangle({0.6f, 0, 1.2f}, 0.3f, 0.3f))) << "20 cm above";
  EXPECT_TRUE(apart(Rectangle({0, 0, 1.2f}, 0.3f, 0.3f)));
  EXPECT_TRUE(apart(Rectangle({0, 0, 1.04f}, 0.3f, 0.3f))) << "4 cm above, on the average 2 cm";
  const Eigen::Quaternionf over(
      Eigen::AngleAxisf(std::numbers::pi_v<float>, Eigen::Vector3f::UnitX()));
  PlanarGaussian back = Rectangle({0.6f, 0, -1}, 0.3f, 0.3f, over);
  EXPECT_TRUE(apart(back)) << "the other side of a wall";
  const Eigen::Quaternionf up(
      Eigen::AngleAxisf(0.5f * std::numbers::pi_v<float>, Eigen::Vector3f::UnitY()));
  EXPECT_TRUE(apart(Rectangle({-1.3f, 0, 0.3f}, 0.3f, 0.3f, up))) << "a corner";
  EXPECT_TRUE(apart(Rectangle({0.9f, 0, 1}, 0.3f, 0.3f))) << "a gap of half a side";
  EXPECT_FALSE(apart(Rectangle({0.6f, 0, 1.005f}, 0.3f, 0.3f)));
}

TEST(CoverPlanes, DoesNotBridgeAGapHoweverManyLieUponEachOther) {
  std::vector<PlanarGaussian> gaussians(6, Rectangle({0, 0, 1}, 0.1f, 0.1f));
  gaussians.push_back(Rectangle({0.4f, 0, 1}, 0.1f, 0.1f));
  const std::vector<PlaneCover> covers = Cover(gaussians);
  ASSERT_EQ(covers.size(), 1u);
  EXPECT_EQ(covers[0].members, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_NEAR(covers[0].disc.u.norm() * kEdge, 0.1f, 1e-5f);
}

TEST(CoverPlanes, ReachesAsFarAsItsMembers) {
  PlaneCoverConfig config = OneCell();
  config.fill = 0.5;
  // Moments alone would end at 0.53 m.
  const std::vector<PlaneCover> covers =
      Cover({Rectangle({0, 0, 1}, 0.2f, 0.2f), Rectangle({0.5f, 0, 1}, 0.1f, 0.1f)}, config);
  ASSERT_EQ(covers.size(), 1u);
  EXPECT_TRUE(IsIn(covers[0].disc, {-0.16f, 0, 1}));
  EXPECT_TRUE(IsIn(covers[0].disc, {0.575f, 0, 1}));
}

TEST(CoverPlanes, LeavesWindowsOpen) {
  std::vector<PlanarGaussian> wall = Tiles(9, 9, 0.1f, {0, 0, 1});
  std::erase_if(wall, [](const PlanarGaussian& tile) {
    return tile.disc.mean.head<2>().cwiseAbs().maxCoeff() < 0.16f;  // 3 x 3 in the middle
  });
  const std::vector<Disc> left = After(wall, Cover(wall));
  EXPECT_LT(left.size(), wall.size() / 2);
  for (const Disc& disc : left) EXPECT_FALSE(IsIn(disc, {0, 0, 1}, 1.0f));
}

TEST(CoverPlanes, MakesNoneLargerThanAllowed) {
  PlaneCoverConfig config = OneCell();
  config.max_scale_m = 0.2;
  const std::vector<PlanarGaussian> tiles = Tiles(12, 12, 0.1f, {0, 0, 1});
  const std::vector<PlaneCover> covers = Cover(tiles, config);
  EXPECT_GT(covers.size(), 3u);
  for (const PlaneCover& cover : covers) {
    EXPECT_LE(std::max(cover.disc.u.norm(), cover.disc.v.norm()), 0.2f + 1e-6f);
  }
}

TEST(CoverPlanes, JoinsLargeOnesUponEachOtherWithoutGrowing) {
  PlaneCoverConfig config = OneCell();
  config.max_scale_m = 0.2;
  const PlanarGaussian large = Rectangle({0, 0, 1}, 0.5f, 0.4f);
  const PlanarGaussian detail = Rectangle({0.2f, 0.1f, 1}, 0.1f, 0.1f);
  const std::vector<PlaneCover> covers =
      Cover({large, Rectangle({0.02f, 0, 1}, 0.45f, 0.4f), detail}, config);
  ASSERT_EQ(covers.size(), 1u);
  EXPECT_EQ(covers[0].members, (std::vector<std::size_t>{0, 1}));
  EXPECT_LE(covers[0].disc.u.norm(), large.disc.u.norm() + 1e-6f);
  EXPECT_GT(covers[0].disc.u.norm(), 0.9f * large.disc.u.norm());
  EXPECT_TRUE(Cover({large, Rectangle({0.5f, 0, 1}, 0.5f, 0.4f)}, config).empty())
      << "half upon it";
}

TEST(CoverPlanes, RemovesTheMostRedundantIfNotAllMayGo) {
  std::vector<PlanarGaussian> gaussians = Tiles(2, 1, 0.1f, {-2, -2, 1});
  const std::vector<PlanarGaussian> many = Tiles(4, 1, 0.1f, {2, 2, 1});
  gaussians.insert(gaussians.end(), many.begin(), many.end());
  PlaneCoverConfig config = OneCell();
  config.max_share = 0.5;  // 3 of 6
  const std::vector<PlaneCover> covers = Cover(gaussians, config);
  ASSERT_EQ(covers.size(), 1u);
  EXPECT_EQ(covers[0].members, (std::vector<std::size_t>{2, 3, 4, 5}));
}

TEST(CoverPlanes, JoinsAcrossBordersOfCells) {
  PlaneCoverConfig config = OneCell();
  config.cell_m = 0.4;
  config.passes = 2;  // 0.2 m, then 0.4 m, shifted by half
  EXPECT_EQ(Cover(Tiles(2, 1, 0.1f, {0.4f, 0.35f, 1.0f}), config).size(), 1u);
}

TEST(CoverPlanes, OfNothingIsNothing) {
  EXPECT_TRUE(Cover({}).empty());
  EXPECT_TRUE(Cover({Rectangle({0, 0, 1}, 0.1f, 0.1f)}).empty());
}

}  // namespace
}  // namespace covsplat::test
