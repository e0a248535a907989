#include "covsplat/report/format.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(Format, PicksUnitsForPeople) {
  EXPECT_EQ(FormatBytes(512), "512 B");
  EXPECT_EQ(FormatBytes(21.34e6), "21.3 MB");
  EXPECT_EQ(FormatBytes(1.5e9), "1.50 GB");
  EXPECT_EQ(FormatCount(950), "950");
  EXPECT_EQ(FormatCount(184213), "184 213");
  EXPECT_EQ(FormatCount(1.234e6), "1.23 M");
  EXPECT_EQ(FormatSeconds(12.34), "12.3 s");
  EXPECT_EQ(FormatSeconds(245), "4:05 min");
  EXPECT_EQ(FormatSeconds(3723), "1:02:03 h");
  EXPECT_EQ(FormatMetres(0.0032), "3.2 mm");
  EXPECT_EQ(FormatMetres(0.047), "4.7 cm");
  EXPECT_EQ(FormatMetres(76.41), "76.4 m");
  EXPECT_EQ(FormatMetres(1250), "1.25 km");
  EXPECT_EQ(FormatNumber(0), "0.00");
  EXPECT_EQ(FormatNumber(12.71), "12.7");
  EXPECT_EQ(FormatNumber(1234.5), "1234");
}

TEST(Format, SaysSoWhenThereIsNoNumber) {
  for (const double broken : {NAN, INFINITY, -INFINITY}) {
    EXPECT_EQ(FormatBytes(broken), "n/a");
    EXPECT_EQ(FormatCount(broken), "n/a");
    EXPECT_EQ(FormatSeconds(broken), "n/a");
    EXPECT_EQ(FormatMetres(broken), "n/a");
    EXPECT_EQ(FormatNumber(broken), "n/a");
  }
}

}  // namespace
}  // namespace covsplat
