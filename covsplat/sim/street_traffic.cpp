#include <algorithm>
#include <memory>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/street.hpp"
#include "covsplat/sim/street_people.hpp"
#include "covsplat/sim/street_plan.hpp"

namespace covsplat {
namespace {

using P = StreetPlan;

const Eigen::Vector2d kOrigin = Eigen::Vector2d::Zero();

}  // namespace

std::vector<Mover> StreetTraffic(int seed) {
  constexpr int kCars = 9;
  constexpr int kPeople = 16;
  Rng rng(static_cast<std::uint64_t>(seed), 2);
  std::vector<Mover> movers;
  // The inner lane, the other way round.
  std::vector<Eigen::Vector3d> lane = StreetRing(kOrigin, -static_cast<double>(P::kLane), 8.0);
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
    movers.push_back(Stroller(kOrigin, side * 8.3, 37.0 * i + rng.Uniform(0.0, 10.0), rng));
  }
  return movers;
}

}  // namespace covsplat
