#include "covsplat/sim/travel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace covsplat {
namespace {

constexpr double kKnotS = 0.25;
constexpr int kStandingKnots = 6;  // a cubic rests for three fewer: 0.75 s

}  // namespace

Travel::Travel(const Path& path,
               double length_m,
               const std::function<double(double)>& speed_mps,
               double full_speed_mps) {
  double heading = path.Heading(0.0);
  const auto step_to = [&](double distance_m, double vigour) {
    heading += std::remainder(path.Heading(distance_m) - heading, 2.0 * std::numbers::pi);
    Control control;
    control << path.At(distance_m), heading, vigour, path.Slope(distance_m);
    controls_.push_back(control);
  };
  for (int i = 0; i < kStandingKnots; ++i) step_to(0.0, 0.0);
  double distance_m = 0.0;
  while (true) {
    const double speed = speed_mps(distance_m);
    distance_m += speed * kKnotS;
    if (distance_m >= length_m) break;
    step_to(distance_m, std::clamp(speed / full_speed_mps, 0.0, 1.0));
  }
  for (int i = 0; i < kStandingKnots; ++i) step_to(length_m, 0.0);
}

double Travel::Duration() const { return kKnotS * static_cast<double>(controls_.size() - 3); }

Travel::State Travel::At(double time_s) const {
  const auto last = static_cast<std::ptrdiff_t>(controls_.size()) - 1;
  const auto control_at = [&](std::ptrdiff_t i) -> const Control& {
    return controls_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, last))];
  };
  const auto state = CubicBSpline<Control>(time_s / kKnotS, control_at);
  return {state.head<3>(), state(3), state(5), state(4)};
}

}  // namespace covsplat
