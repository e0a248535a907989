#include "covsplat/report/colormap.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

double Luminance(Rgb c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

TEST(RangeColor, GetsSteadilyBrighterAndClamps) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_LE(Luminance(RangeColor(0.01 * i)), Luminance(RangeColor(0.01 * (i + 1))) + 0.5) << i;
  }
  EXPECT_EQ(RangeColor(-5.0), RangeColor(0.0));
  EXPECT_EQ(RangeColor(INFINITY), RangeColor(1.0));
  EXPECT_EQ(RangeColor(NAN), kNoDataColor);
}

TEST(DivergingColor, IsBlueWhiteRed) {
  EXPECT_GT(DivergingColor(-1.0).b, DivergingColor(-1.0).r);
  EXPECT_EQ(DivergingColor(0.0), (Rgb{247, 247, 247}));
  EXPECT_GT(DivergingColor(1.0).r, DivergingColor(1.0).b);
  EXPECT_EQ(DivergingColor(NAN), kNoDataColor);
}

TEST(NormalColor, MapsAxesToPrimaries) {
  EXPECT_EQ(NormalColor({0, 0, 1}), (Rgb{128, 128, 255}));
  EXPECT_EQ(NormalColor({-1, 0, 0}), (Rgb{0, 128, 128}));
  EXPECT_EQ(NormalColor({0, 0, 0}), kNoDataColor);
  EXPECT_EQ(NormalColor({NAN, 0, 1}), kNoDataColor);
}

TEST(ColorizeRange, NearIsBrightAndMissingIsNoData) {
  Image<float> range(1, 4);
  range(0, 0) = 1.0F;
  range(0, 1) = 100.0F;
  range(0, 2) = 0.0F;
  range(0, 3) = NAN;
  const Image<Rgb> image = ColorizeRange(range, 1.0, 100.0);
  EXPECT_EQ(image(0, 0), RangeColor(1.0));
  EXPECT_EQ(image(0, 1), RangeColor(0.0));
  EXPECT_EQ(image(0, 2), kNoDataColor);
  EXPECT_EQ(image(0, 3), kNoDataColor);
}

}  // namespace
}  // namespace covsplat
