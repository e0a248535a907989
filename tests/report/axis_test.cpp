#include "covsplat/report/axis.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(Ticks, StandAtRoundNumbersInside) {
  const Ticks ticks = NiceTicks({-3.2, 11.9, false}, 5);
  EXPECT_EQ(ticks.at, (std::vector<double>{0.0, 5.0, 10.0}));
  EXPECT_EQ(ticks.Label(5.0), "5");
  const Ticks fine = NiceTicks({0.0, 0.03, false}, 3);
  EXPECT_EQ(fine.at.size(), 4U);
  EXPECT_EQ(fine.Label(fine.at[3]), "0.03");
}

TEST(Ticks, AreFewForAnyInterval) {
  for (const double length : {1e-9, 1e-3, 0.7, 1.0, 9.99, 1e4, 1e15}) {
    for (const double low : {0.0, -0.3 * length, 5.0 * length}) {
      const Ticks ticks = NiceTicks({low, low + length, false}, 6);
      EXPECT_GE(ticks.at.size(), 2U) << length;
      EXPECT_LE(ticks.at.size(), 8U) << length;
    }
  }
}

TEST(Bounds, IgnoreWhatIsNotFinite) {
  Bounds bounds;
  bounds.Include(std::numeric_limits<double>::quiet_NaN());
  bounds.Include(std::numeric_limits<double>::infinity());
  EXPECT_TRUE(bounds.empty);
  bounds.Include(2.0);
  bounds.Include(-1.0);
  EXPECT_EQ(bounds.low, -1.0);
  EXPECT_EQ(bounds.high, 2.0);
}

TEST(Bounds, WidenMakesAnythingDrawable) {
  for (const Bounds& bounds : {Bounds{}, Bounds{0, 0, false}, Bounds{1e15, 1e15, false}}) {
    const Bounds wide = Widen(bounds, 0.05);
    EXPECT_GT(wide.high, wide.low);
    EXPECT_GT(NiceTicks(wide, 5).at.size(), 0U);
  }
}

}  // namespace
}  // namespace covsplat
