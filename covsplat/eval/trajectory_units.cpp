#include "covsplat/eval/trajectory_units.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

struct Span {
  double first_s = 0.0;
  double last_s = 0.0;

  double Length() const { return last_s - first_s; }
};

struct Unit {
  const char* name;
  double per_second;
};
constexpr std::array kUnits = {
    Unit{"milliseconds", 1e3}, Unit{"microseconds", 1e6}, Unit{"nanoseconds", 1e9}};

Span SpanOf(const Trajectory& t) { return {t.front().stamp_s, t.back().stamp_s}; }

bool Overlap(const Span& a, const Span& b) {
  return a.first_s <= b.last_s && b.first_s <= a.last_s;
}

Span Divided(const Span& span, double by) { return {span.first_s / by, span.last_s / by}; }

/// Times since 1970 rather than since a start: an overlap of these is no accident.
bool IsCalendar(const Span& span) { return span.first_s > 1e8; }

bool Alike(double a, double b, double ratio) { return a < ratio * b && b < ratio * a; }

/// Whether two spans fit once one of them is in seconds.
bool Fit(const Span& a, const Span& b) {
  return Alike(a.Length(), b.Length(), 5.0) || (Overlap(a, b) && IsCalendar(a) && IsCalendar(b));
}

std::string TextOf(const Span& span) {
  return fmt::format("{:.3f} to {:.3f} s", span.first_s, span.last_s);
}

std::optional<std::string> LooksLike(const Span& estimate, const Span& truth) {
  for (const Unit& unit : kUnits) {
    if (Fit(Divided(estimate, unit.per_second), truth)) {
      return fmt::format("the times of the estimate look like {}", unit.name);
    }
    if (Fit(estimate, Divided(truth, unit.per_second))) {
      return fmt::format("the times of the truth look like {}", unit.name);
    }
  }
  if (Overlap(estimate, truth)) return "their times overlap, but the truth has gaps there";
  if (Alike(estimate.Length(), truth.Length(), 1.5)) {
    return fmt::format(
        "both last about as long; if their clocks start at different times, try "
        "--time-offset {:.3f}",
        truth.first_s - estimate.first_s);
  }
  return std::nullopt;
}

}  // namespace

std::string ExplainNoOverlap(const Trajectory& estimate, const Trajectory& truth) {
  COVSPLAT_CHECK(!estimate.empty() && !truth.empty());
  const Span of_estimate = SpanOf(estimate);
  const Span of_truth = SpanOf(truth);
  return fmt::format("estimate {}, truth {}; {}",
                     TextOf(of_estimate),
                     TextOf(of_truth),
                     LooksLike(of_estimate, of_truth).value_or("are both in the same clock?"));
}

std::optional<std::string> OddMatch(const Trajectory& estimate,
                                    const Trajectory& truth,
                                    const TrajectoryError& error) {
  constexpr double kOddRatio = 300.0;
  const double ratio = error.truth_length_m / std::max(error.estimate_length_m, 1e-9);
  if (error.truth_length_m > 0.0 && error.estimate_length_m > 0.0 &&
      (ratio > kOddRatio || ratio < 1.0 / kOddRatio)) {
    return fmt::format("the path of the {} is {:.0f} times longer; is it in millimetres?",
                       ratio > 1.0 ? "truth" : "estimate",
                       std::max(ratio, 1.0 / ratio));
  }
  if (error.without_truth > error.matched) {
    return fmt::format("only {} of {} poses have a truth at their time: {}",
                       error.matched,
                       error.matched + error.without_truth,
                       ExplainNoOverlap(estimate, truth));
  }
  return std::nullopt;
}

}  // namespace covsplat
