#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/street.hpp"

namespace covsplat {
namespace {

using P = StreetPlan;

// Somebody who walks to and fro along a pavement.
Motion Stroll(double offset_m, double from_m, double length_m, double speed_mps) {
  const Path ring(StreetRing(offset_m, 0.5), true);
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

std::vector<Mover> StreetTraffic(int seed) {
  constexpr int kCars = 9;
  constexpr int kPeople = 16;
  Rng rng(static_cast<std::uint64_t>(seed), 2);
  std::vector<Mover> movers;
  // The inner lane, the other way round.
  std::vector<Eigen::Vector3d> lane = StreetRing(-static_cast<double>(P::kLane), 8.0);
  std::reverse(lane.begin(), lane.end());
  const auto path = std::make_shared<const Path>(std::move(lane), true);
  for (int i = 0; i < kCars; ++i) {
    const double start_m = path->Length() * (i + rng.Uniform(-0.2, 0.2)) / kCars;
    movers.push_back(MakeMover(std::make_shared<const Scene>(CarShape(rng)),
                               PointLabel::kMovingCar,
                               Circling(path, StreetGround, start_m, 8.0)));
  }
  for (int i = 0; i < kPeople; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    const double from_m = 37.0 * i + rng.Uniform(0.0, 10.0);
    const double length_m = rng.Uniform(14.0, 24.0);
    const double speed_mps = rng.Uniform(1.1, 1.5);
    movers.push_back(MakeMover(std::make_shared<const Scene>(PersonShape(rng)),
                               PointLabel::kMovingPerson,
                               Stroll(side * 8.3, from_m, length_m, speed_mps)));
  }
  return movers;
}

}  // namespace covsplat
