#include "covsplat/sim/street_people.hpp"

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "covsplat/sim/street_plan.hpp"

namespace covsplat {
namespace {

using P = StreetPlan;

Motion Stroll(const Eigen::Vector2d& origin,
              double offset_m,
              double from_m,
              double length_m,
              double speed_mps) {
  const Path ring(StreetRing(origin, offset_m, 0.5), true);
  std::vector<Eigen::Vector3d> there;
  std::vector<Eigen::Vector3d> back;
  constexpr double kStepM = 2.0;
  constexpr double kHalfWidthM = 0.35;
  for (double at = 0.0; at <= length_m; at += kStepM) {
    const Eigen::Vector3d middle = ring.At(from_m + at);
    const double heading = ring.Heading(from_m + at);
    const Eigen::Vector3d aside(
        -kHalfWidthM * std::sin(heading), kHalfWidthM * std::cos(heading), 0.0);
    there.push_back(middle - aside);
    back.push_back(middle + aside);
  }
  there.insert(there.end(), back.rbegin(), back.rend());
  return Circling(
      std::make_shared<const Path>(there, true),
      [](double x, double y) { return StreetGround(x, y) + static_cast<double>(P::kKerbHeight); },
      0.0,
      speed_mps);
}

}  // namespace

Mover Stroller(const Eigen::Vector2d& origin, double offset_m, double from_m, Rng& rng) {
  const double length_m = rng.Uniform(14.0, 24.0);
  const double speed_mps = rng.Uniform(1.1, 1.5);
  auto shape = std::make_shared<const Scene>(PersonShape(rng));
  return MakeMover(std::move(shape),
                   PointLabel::kMovingPerson,
                   Stroll(origin, offset_m, from_m, length_m, speed_mps));
}

}  // namespace covsplat
