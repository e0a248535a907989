#include "covsplat/eval/trajectory_units.hpp"

#include <gtest/gtest.h>

namespace covsplat {
namespace {

/// 60 s at 10 Hz and 1 m/s.
Trajectory Line(double first_s, double time_scale = 1.0, double length_scale = 1.0) {
  Trajectory trajectory;
  for (int i = 0; i <= 600; ++i) {
    trajectory.push_back({time_scale * (first_s + 0.1 * i),
                          SE3(Eigen::Quaterniond::Identity(), {length_scale * 0.1 * i, 0.0, 0.0})});
  }
  return trajectory;
}

void ExpectSays(const std::string& text, const char* part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST(TrajectoryUnits, TimesInOtherUnitsAreNamed) {
  constexpr double kEpoch = 1.7e9;
  ExpectSays(ExplainNoOverlap(Line(kEpoch, 1e9), Line(kEpoch)), "estimate look like nanoseconds");
  ExpectSays(ExplainNoOverlap(Line(kEpoch), Line(kEpoch, 1e3)), "truth look like milliseconds");
  ExpectSays(ExplainNoOverlap(Line(0.0), Line(0.0, 1e6)), "truth look like microseconds");
  Trajectory part = Line(kEpoch, 1e9);
  part.resize(20);  // a thirtieth of the truth
  ExpectSays(ExplainNoOverlap(part, Line(kEpoch)), "estimate look like nanoseconds");
}

TEST(TrajectoryUnits, ClocksThatStartElsewhereGetAnOffset) {
  ExpectSays(ExplainNoOverlap(Line(0.0), Line(1.7e9)), "--time-offset 1700000000.000");
}

TEST(TrajectoryUnits, GapsAreNotTakenForUnits) {
  Trajectory sparse = {Line(0.0).front(), Line(0.0).back()};
  ExpectSays(ExplainNoOverlap(Line(0.05), sparse), "gaps");
}

TEST(TrajectoryUnits, PathsInMillimetresAreOdd) {
  const auto odd = [](const Trajectory& estimate, const Trajectory& truth) {
    return OddMatch(estimate, truth, EvaluateTrajectory(estimate, truth)).value_or("nothing");
  };
  ExpectSays(odd(Line(0.0), Line(0.0)), "nothing");
  ExpectSays(odd(Line(0.0), Line(0.0, 1.0, 1e3)), "path of the truth is 1000 times longer");
  ExpectSays(odd(Line(0.0, 1.0, 1e3), Line(0.0)), "path of the estimate is 1000 times longer");
  ExpectSays(odd(Line(0.0), Line(0.0, 1e3)), "milliseconds");
}

}  // namespace
}  // namespace covsplat
