#include "covsplat/sim/street_plan.hpp"

#include <cmath>

#include "covsplat/sim/path.hpp"

namespace covsplat {

using P = StreetPlan;

double StreetGround(double x, double y) {
  return 0.5 * std::sin(0.021 * x + 0.4) * std::cos(0.03 * y) + 0.004 * y;
}

std::vector<Eigen::Vector3d> StreetRing(const Eigen::Vector2d& origin,
                                        double offset_m,
                                        double corner_radius_m) {
  constexpr double kSpacingM = 3.0;
  const Eigen::Vector2d low = origin - Eigen::Vector2d::Constant(offset_m);
  const Eigen::Vector2d high = origin + Eigen::Vector2d(static_cast<double>(P::kLength) + offset_m,
                                                        static_cast<double>(P::kWidth) + offset_m);
  return AlongStreets(
      {low, {high.x(), low.y()}, high, {low.x(), high.y()}}, true, corner_radius_m, kSpacingM);
}

}  // namespace covsplat
