#include "covsplat/core/way_spread.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(LeastMissed, IsTheOneWhoseNeighboursAreNearest) {
  EXPECT_EQ(LeastMissed(std::vector{0.0, 5.0, 10.0, 11.0, 12.0, 20.0}, 0), 3u);
}

TEST(LeastMissed, IsTheOldestOfSeveralAlike) {
  EXPECT_EQ(LeastMissed(std::vector{0.0, 1.0, 2.1, 3.0, 4.0}, 0), 1u);
}

TEST(LeastMissed, IsNeitherTheFirstNorOneOfTheNewest) {
  const std::vector<double> way_m = {0.0, 10.0, 20.0, 20.1, 20.2};
  EXPECT_EQ(LeastMissed(way_m, 3), 1u);
  EXPECT_EQ(LeastMissed(way_m, 4), std::nullopt);
  EXPECT_EQ(LeastMissed(std::vector{0.0, 1.0}, 0), std::nullopt);
  EXPECT_EQ(LeastMissed({}, 0), std::nullopt);
}

TEST(LeastMissed, OneByOneLeavesTheWholeWayCovered) {
  constexpr std::size_t kKept = 50;
  constexpr std::size_t kNewest = 10;
  std::vector<double> way_m;
  for (int i = 0; i < 1000; ++i) {
    way_m.push_back(i);
    if (way_m.size() <= kKept) continue;
    const auto least = LeastMissed(way_m, kNewest);
    ASSERT_TRUE(least);
    way_m.erase(way_m.begin() + static_cast<std::ptrdiff_t>(*least));
  }
  double widest_m = 0.0;
  for (std::size_t i = 1; i < way_m.size(); ++i) {
    widest_m = std::max(widest_m, way_m[i] - way_m[i - 1]);
  }
  EXPECT_LT(widest_m, 3.0 * 1000 / kKept);
  EXPECT_EQ(way_m.front(), 0.0);
  EXPECT_EQ(way_m[kKept - kNewest], 990.0) << "the newest are all there";
}

}  // namespace
}  // namespace covsplat
