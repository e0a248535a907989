#include "covsplat/registration/nearest_index.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat::test {
namespace {

std::vector<Eigen::Vector3f> RandomPoints(std::size_t n, double extent_m, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Eigen::Vector3f> points(n);
  for (Eigen::Vector3f& p : points) {
    for (int k = 0; k < 3; ++k) p[k] = static_cast<float>(rng.Uniform(-extent_m, extent_m));
  }
  return points;
}

int BruteForce(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& q, float max) {
  int best = -1;
  float best_squared = max;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f d = points[i] - q;
    const float squared = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
    if (squared < best_squared) {
      best = static_cast<int>(i);
      best_squared = squared;
    }
  }
  return best;
}

TEST(NearestIndex, AgreesWithBruteForceForAnyCellSizeAndHint) {
  const std::vector<Eigen::Vector3f> points = RandomPoints(3000, 6.0, 1);
  const std::vector<Eigen::Vector3f> queries = RandomPoints(500, 7.0, 2);
  for (const float cell_m : {0.2f, 0.5f, 1.0f, 3.0f}) {
    const NearestIndex index(points, cell_m);
    for (std::size_t q = 0; q < queries.size(); ++q) {
      const int expected = BruteForce(points, queries[q], 1.0f);
      for (const int hint : {-1, static_cast<int>(q)}) {
        const NearestIndex::Match match = index.Nearest(queries[q], 1.0f, hint);
        ASSERT_EQ(match.slot < 0 ? -1 : index.IndexOf(match.slot), expected) << cell_m;
        if (expected < 0) {
          ASSERT_TRUE(std::isinf(match.squared_distance));
        }
      }
    }
  }
}

TEST(NearestIndex, PrefersTheLowerIndexAmongEquals) {
  std::vector<Eigen::Vector3f> points(8, Eigen::Vector3f(0.25f, 0.0f, 0.0f));
  points.insert(points.begin(), Eigen::Vector3f(-0.25f, 0.0f, 0.0f));
  points.insert(points.begin(), Eigen::Vector3f(5.0f, 0.0f, 0.0f));
  const NearestIndex index(points, 0.2f);
  for (int hint = -1; hint < static_cast<int>(points.size()); ++hint) {
    EXPECT_EQ(index.IndexOf(index.Nearest(Eigen::Vector3f::Zero(), 1.0f, hint).slot), 1);
  }
}

TEST(NearestIndex, TakesAnyQueryAndNoPoints) {
  const NearestIndex empty({}, 1.0f);
  EXPECT_EQ(empty.Nearest(Eigen::Vector3f::Zero(), 1.0f).slot, -1);
  const NearestIndex index(RandomPoints(100, 1.0, 3), 0.5f);
  for (const float x : {std::nanf(""), 1e30f, -1e30f, std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(index.Nearest(Eigen::Vector3f(x, x, x), 1.0f).slot, -1);
    EXPECT_EQ(index.Nearest(Eigen::Vector3f(0, x, 0), 1.0f, 5).slot, -1);
  }
}

}  // namespace
}  // namespace covsplat::test
