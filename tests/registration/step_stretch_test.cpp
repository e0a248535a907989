#include "covsplat/registration/step_stretch.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

Vector18d Along(int axis, double length) { return length * Vector18d::Unit(axis); }

/// Steps until one that covers the share `held` less than the whole way is within 1e-4 of it.
int StepsToTheEnd(double held, bool stretched) {
  StepStretch stretch;
  double left = 1.0;
  int steps = 0;
  for (; std::abs(left) > 1e-4; ++steps) {
    const Vector18d step = Along(3, (1.0 - held) * left);
    left -= (stretched ? stretch.Of(step) : 1.0) * step[3];
  }
  return steps;
}

TEST(StepStretch, EndsAGeometricSeries) {
  for (const double held : {0.3, 0.5, 0.7, 0.85}) {
    EXPECT_LE(StepsToTheEnd(held, true), 6) << held;
    EXPECT_LT(StepsToTheEnd(held, true), StepsToTheEnd(held, false)) << held;
  }
}

TEST(StepStretch, GrowsWhileStepsDoNotShrinkUpToALimit) {
  StepStretch stretch;
  for (const double factor : {1.0, 2.0, 4.0, 8.0, 8.0, 8.0}) {
    EXPECT_EQ(stretch.Of(Along(0, 0.01)), factor);
  }
}

TEST(StepStretch, LeavesStepsThatTurnOrComeBackAlone) {
  StepStretch stretch;
  stretch.Of(Along(0, 0.01));
  EXPECT_GT(stretch.Of(Along(0, 0.01)), 1.0);
  EXPECT_EQ(stretch.Of(Along(0, -0.01)), 1.0);
  EXPECT_EQ(stretch.Of(Along(4, 0.01)), 1.0);
  EXPECT_EQ(stretch.Of(Vector18d::Zero()), 1.0);
  EXPECT_EQ(stretch.Of(Along(4, 0.01)), 1.0);
}

TEST(StepStretch, ForgetsAStepThatWasNotMade) {
  StepStretch stretch;
  stretch.Of(Along(0, 0.01));
  stretch.Forget();
  EXPECT_EQ(stretch.Of(Along(0, 0.01)), 1.0);
}

}  // namespace
}  // namespace covsplat::test
