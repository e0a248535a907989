#include "covsplat/sim/street_props.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace covsplat {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kGlass = 0.08f;
constexpr float kRubber = 0.06f;
constexpr float kMetal = 0.35f;

float Draw(Rng& rng, float low, float high) { return static_cast<float>(rng.Uniform(low, high)); }

// A frame on the ground that looks along `yaw_rad`.
struct Stand {
  Vector3f base;
  float yaw_rad = 0.0f;

  Vector3f At(float x, float y, float z) const {
    return base + Vector3f(x * std::cos(yaw_rad) - y * std::sin(yaw_rad),
                           x * std::sin(yaw_rad) + y * std::cos(yaw_rad),
                           z);
  }
};

// A body with a convex outline in the x-z plane; each corner has its own half width.
struct OutlineCorner {
  float x = 0.0f;
  float z = 0.0f;
  float half_width = 0.0f;
};

void AddHull(MeshBuilder& mesh,
             const Stand& stand,
             const std::vector<OutlineCorner>& outline,
             float reflectivity) {
  const auto corner = [&](std::size_t i, float side) {
    const OutlineCorner& at = outline[i % outline.size()];
    return stand.At(at.x, side * at.half_width, at.z);
  };
  for (std::size_t i = 0; i < outline.size(); ++i) {
    mesh.Quad(
        corner(i, 1.0f), corner(i + 1, 1.0f), corner(i + 1, -1.0f), corner(i, -1.0f), reflectivity);
  }
  for (const float side : {-1.0f, 1.0f}) {
    for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
      mesh.Facet(corner(0, side), corner(i, side), corner(i + 1, side), reflectivity);
    }
  }
}

struct CarKind {
  float length = 4.3f;
  float waist_z = 0.85f;
  float roof_z = 1.45f;
  float roof_front = 0.3f;  // x of the roof's ends
  float roof_rear = -1.2f;
  float cabin_front = 0.95f;
  float cabin_rear = -1.75f;
};

constexpr std::array<CarKind, 3> kCars = {CarKind{4.4f, 0.85f, 1.43f, 0.3f, -1.0f, 1.0f, -1.75f},
                                          CarKind{4.5f, 0.9f, 1.5f, 0.3f, -1.95f, 1.0f, -2.1f},
                                          CarKind{4.9f, 1.05f, 2.0f, 1.1f, -2.35f, 1.8f, -2.4f}};

}  // namespace

void AddCar(MeshBuilder& mesh, const Vector3f& base, float yaw_rad, Rng& rng) {
  const Stand stand{base, yaw_rad};
  const CarKind& car = kCars[rng.Below(kCars.size())];
  const float paint = Draw(rng, 0.15f, 0.7f);
  const float half = 0.5f * car.length;
  AddHull(mesh,
          stand,
          {{half - 0.1f, 0.22f, 0.78f},
           {half, 0.45f, 0.82f},
           {half - 0.15f, 0.68f, 0.84f},
           {car.cabin_front, car.waist_z, 0.88f},
           {-half + 0.1f, car.waist_z, 0.86f},
           {-half, 0.5f, 0.84f},
           {-half + 0.1f, 0.22f, 0.8f}},
          paint);
  AddHull(mesh,
          stand,
          {{car.cabin_front, car.waist_z, 0.8f},
           {car.roof_front, car.roof_z, 0.62f},
           {car.roof_rear, car.roof_z, 0.62f},
           {car.cabin_rear, car.waist_z, 0.8f}},
          paint);
  for (const float side : {-1.0f, 1.0f}) {  // side windows a little outside the cabin
    mesh.Quad(stand.At(car.cabin_front - 0.3f, side * 0.8f, car.waist_z + 0.05f),
              stand.At(car.roof_front - 0.1f, side * 0.68f, car.roof_z - 0.1f),
              stand.At(car.roof_rear + 0.1f, side * 0.68f, car.roof_z - 0.1f),
              stand.At(car.cabin_rear + 0.3f, side * 0.8f, car.waist_z + 0.05f),
              kGlass);
    mesh.Box(stand.At(car.cabin_front - 0.2f, side * 0.95f, car.waist_z),
             {0.12f, 0.18f, 0.14f},
             yaw_rad,
             paint);  // mirror
    for (const float x : {0.62f * half, -0.6f * half}) {
      mesh.Ellipsoid(stand.At(x, side * 0.74f, 0.32f), {0.32f, 0.32f, 0.32f}, 2, kRubber);
    }
  }
}

void AddPerson(MeshBuilder& mesh, const Vector3f& base, float yaw_rad, Rng& rng) {
  const Stand stand{base, yaw_rad};
  const float height = Draw(rng, 1.55f, 1.9f);
  const float coat = Draw(rng, 0.2f, 0.7f);
  for (const float side : {-1.0f, 1.0f}) {
    const float stride = 0.22f * side;  // opposite legs and arms
    mesh.Ellipsoid(stand.At(0.5f * stride, 0.1f * side, 0.26f * height),
                   {0.09f, 0.09f, 0.27f * height},
                   2,
                   coat);
    mesh.Ellipsoid(stand.At(-0.6f * stride, 0.25f * side, 0.63f * height),
                   {0.06f, 0.06f, 0.18f * height},
                   2,
                   coat);
  }
  mesh.Ellipsoid(stand.At(0.0f, 0.0f, 0.66f * height), {0.17f, 0.21f, 0.2f * height}, 3, coat);
  mesh.Ellipsoid(stand.At(0.02f, 0.0f, 0.93f * height), {0.1f, 0.09f, 0.12f}, 2, 0.5f);
}

void AddRoadSign(MeshBuilder& mesh, const Vector3f& base, float yaw_rad) {
  mesh.Cylinder(base, 0.035f, 0.035f, 2.9f, 8, kMetal);
  const Stand stand{base, yaw_rad};
  mesh.Box(stand.At(0.05f, 0.0f, 2.2f), {0.02f, 0.6f, 0.6f}, yaw_rad, 0.9f);
}

void AddLitterBin(MeshBuilder& mesh, const Vector3f& base) {
  mesh.Cylinder(base, 0.22f, 0.26f, 0.85f, 12, 0.2f);
  mesh.Cylinder(base + Vector3f(0.0f, 0.0f, 0.95f), 0.28f, 0.1f, 0.15f, 12, 0.2f);
}

void AddBusShelter(MeshBuilder& mesh, const Vector3f& base, float yaw_rad) {
  const Stand stand{base, yaw_rad};
  for (const float y : {-1.8f, 0.0f, 1.8f}) {
    for (const float x : {-0.6f, 0.6f}) {
      mesh.Box(stand.At(x, y, 0.0f), {0.08f, 0.08f, 2.4f}, yaw_rad, kMetal);
    }
  }
  mesh.Box(stand.At(0.1f, 0.0f, 2.4f), {1.6f, 4.0f, 0.12f}, yaw_rad, kMetal);
  mesh.Box(stand.At(-0.6f, 0.0f, 0.25f), {0.02f, 3.6f, 1.9f}, yaw_rad, 0.25f);
  mesh.Box(stand.At(0.0f, -1.8f, 0.25f), {1.1f, 0.02f, 1.9f}, yaw_rad, 0.25f);
  mesh.Box(stand.At(-0.35f, 0.2f, 0.42f), {0.35f, 2.6f, 0.06f}, yaw_rad, 0.4f);
}

}  // namespace covsplat
