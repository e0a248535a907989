#include "covsplat/sim/street_furniture.hpp"

#include <cmath>
#include <numbers>

#include "covsplat/sim/path.hpp"
#include "covsplat/sim/props.hpp"
#include "covsplat/sim/street_plan.hpp"
#include "covsplat/sim/street_props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;
using P = StreetPlan;

constexpr double kQuarter = 0.5 * std::numbers::pi;

// A line along the ring at which things stand.
class Verge {
 public:
  Verge(const Vector2d& origin, double offset_m) : path_(StreetRing(origin, offset_m, 0.5), true) {}

  double Length() const { return path_.Length(); }

  /// On the ground, `rise_m` above the road.
  Vector3f At(double distance_m, float rise_m) const {
    const Eigen::Vector3d at = path_.At(distance_m);
    return {static_cast<float>(at.x()),
            static_cast<float>(at.y()),
            static_cast<float>(StreetGround(at.x(), at.y())) + rise_m};
  }
  float Heading(double distance_m) const { return static_cast<float>(path_.Heading(distance_m)); }

  /// Away from the corners, where nothing may stand in the way.
  bool IsStraight(double distance_m, double margin_m) const {
    return path_.Curvature(distance_m, 2.0 * margin_m) * 2.0 * margin_m < 0.1;
  }

 private:
  Path path_;
};

void AddTrees(MeshBuilder& mesh, const Vector2d& origin, double side, Rng& rng) {
  const Verge verge(origin, side * 6.4);
  for (double at = rng.Uniform(4.0, 12.0); at < verge.Length(); at += rng.Uniform(17.0, 26.0)) {
    const auto height = static_cast<float>(rng.Uniform(5.5, 8.0));
    const auto crown = static_cast<float>(rng.Uniform(1.5, 2.2));
    if (verge.IsStraight(at, 6.0)) AddTree(mesh, verge.At(at, P::kKerbHeight), height, crown, rng);
  }
}

void AddParkedCars(MeshBuilder& mesh, const Vector2d& origin, double side, Rng& rng) {
  const Verge bays(origin, side * static_cast<double>(P::kParked));
  for (double at = 3.0; at < bays.Length(); at += 6.0) {
    const double where = at + rng.Uniform(-0.3, 0.3);
    const float yaw = bays.Heading(where) + static_cast<float>(rng.Uniform(-0.03, 0.03)) +
                      (side > 0.0 ? 0.0f : std::numbers::pi_v<float>);
    if (rng.Uniform() < 0.55 && bays.IsStraight(where, 12.0)) {
      AddCar(mesh, bays.At(where, 0.0f), yaw, rng);
    }
  }
}

void AddSmallThings(MeshBuilder& mesh, const Vector2d& origin, double side, Rng& rng) {
  const Verge verge(origin, side * 5.95);
  const float facing = static_cast<float>(side * kQuarter);  // to the road, from the heading
  int number = 0;
  for (double at = 9.0; at < verge.Length(); at += rng.Uniform(8.0, 13.0), ++number) {
    if (!verge.IsStraight(at, 4.0)) continue;
    const Vector3f base = verge.At(at, P::kKerbHeight);
    const float yaw = verge.Heading(at);
    switch (number % 5) {
      case 0:
        AddLampPost(mesh, base, 6.0f);
        break;
      case 1:
        AddLitterBin(mesh, base);
        break;
      case 2:
        AddRoadSign(mesh, base, yaw);
        break;
      case 3:
        AddBollard(mesh, base);
        break;
      default:
        mesh.Box(base, {0.9f, 0.4f, 1.3f}, yaw, 0.3f);  // a switch box
    }
  }
  const Verge back(origin, side * 6.8);
  for (double at = 45.0; at < back.Length(); at += rng.Uniform(70.0, 110.0)) {
    if (!back.IsStraight(at, 8.0)) continue;
    const Vector3f base = back.At(at, P::kKerbHeight);
    if (rng.Uniform() < 0.5) {
      AddBusShelter(mesh, base, back.Heading(at) + facing);
    } else {
      AddBench(mesh, base, back.Heading(at) - facing + static_cast<float>(kQuarter));
    }
  }
}

}  // namespace

void AddStreetFurniture(MeshBuilder& mesh, const Vector2d& origin, double side, Rng& rng) {
  AddTrees(mesh, origin, side, rng);
  AddParkedCars(mesh, origin, side, rng);
  AddSmallThings(mesh, origin, side, rng);
}

}  // namespace covsplat
