#include "covsplat/mapping/held_out.hpp"

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(HeldOut, ErrorsOfOneToAHundredCentimetresHaveTheirPercentiles) {
  Image<float> measured(1, 110), rendered(1, 110);
  for (int j = 0; j < 100; ++j) {
    const float error = 0.01f * static_cast<float>((37 * j) % 100);  // 0 to 99 cm, shuffled
    measured(0, j) = 10.0f;
    rendered(0, j) = 10.0f + (j % 2 == 0 ? error : -error);
  }
  for (int j = 100; j < 105; ++j) measured(0, j) = 5.0f;  // not rendered
  for (int j = 105; j < 110; ++j) rendered(0, j) = 5.0f;  // not measured
  const HeldOutErrors errors = MeasureHeldOut(measured, rendered);
  EXPECT_EQ(errors.pixels, 100u);
  EXPECT_NEAR(errors.coverage, 100.0 / 105.0, 1e-12);
  EXPECT_NEAR(errors.mean_abs_m, 0.495, 1e-5);
  EXPECT_NEAR(errors.median_abs_m, 0.50, 1e-5);
  EXPECT_NEAR(errors.p90_abs_m, 0.90, 1e-5);
  EXPECT_NEAR(errors.p95_abs_m, 0.95, 1e-5);
}

TEST(HeldOut, WithoutCommonPixelsEverythingIsZero) {
  const HeldOutErrors errors = MeasureHeldOut(Image<float>(2, 2, 1.0f), Image<float>(2, 2));
  EXPECT_EQ(errors.pixels, 0u);
  EXPECT_EQ(errors.p95_abs_m, 0.0);
  EXPECT_EQ(errors.coverage, 0.0);
}

}  // namespace
}  // namespace covsplat
