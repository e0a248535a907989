#include "covsplat/sim/props.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kBark = 0.25f;
constexpr float kLeaf = 0.45f;
constexpr float kWood = 0.40f;
constexpr float kMetal = 0.30f;
constexpr float kStone = 0.55f;

float Draw(Rng& rng, float low, float high) { return static_cast<float>(rng.Uniform(low, high)); }

Vector3f RandomDirection(Rng& rng) {
  const Vector3f v(static_cast<float>(rng.Normal()),
                   static_cast<float>(rng.Normal()),
                   static_cast<float>(rng.Normal()));
  return v.normalized();
}

void AddLeaf(MeshBuilder& mesh, const Vector3f& centre, Rng& rng) {
  const Vector3f normal = RandomDirection(rng);
  const Vector3f side = 0.5f * Draw(rng, 0.08f, 0.13f) * normal.unitOrthogonal();
  const Vector3f up = Draw(rng, 0.8f, 1.4f) * normal.cross(side);
  mesh.Quad(centre - side - up,
            centre + side - up,
            centre + side + up,
            centre - side + up,
            Draw(rng, kLeaf - 0.1f, kLeaf + 0.1f));
}

Vector3f Turned(float x, float y, float z, float yaw_rad) {
  return {x * std::cos(yaw_rad) - y * std::sin(yaw_rad),
          x * std::sin(yaw_rad) + y * std::cos(yaw_rad),
          z};
}

}  // namespace

void AddTree(MeshBuilder& mesh, const Vector3f& base, float height, float crown_radius, Rng& rng) {
  const float trunk = 0.45f * height;
  mesh.Cylinder(base, 0.035f * height, 0.022f * height, trunk, 12, kBark);
  const Vector3f crown_centre = base + Vector3f(0.0f, 0.0f, 0.66f * height);
  const Vector3f crown_radii(crown_radius, crown_radius, 0.34f * height);
  mesh.Cylinder(base + Vector3f(0.0f, 0.0f, trunk), 0.02f * height, 0.01f, 0.4f * height, 8, kBark);
  // Leaves hang in clusters near the crown's surface, which leaves holes between them.
  constexpr int kClusters = 70;
  constexpr int kLeavesPerCluster = 40;
  for (int i = 0; i < kClusters; ++i) {
    const Vector3f direction = RandomDirection(rng);
    const Vector3f cluster =
        crown_centre + crown_radii.cwiseProduct(direction) * std::cbrt(Draw(rng, 0.2f, 1.0f));
    for (int k = 0; k < kLeavesPerCluster; ++k) {
      AddLeaf(mesh, cluster + Draw(rng, 0.05f, 0.45f) * RandomDirection(rng), rng);
    }
  }
}

void AddHedge(
    MeshBuilder& mesh, const Vector3f& base, const Vector3f& size, float yaw_rad, Rng& rng) {
  const int leaves = static_cast<int>(200.0f * size.prod()) + 200;
  for (int i = 0; i < leaves; ++i) {
    const Vector3f offset = Turned(size.x() * Draw(rng, -0.5f, 0.5f),
                                   size.y() * Draw(rng, -0.5f, 0.5f),
                                   size.z() * Draw(rng, 0.05f, 1.0f),
                                   yaw_rad);
    AddLeaf(mesh, base + offset, rng);
  }
}

void AddBench(MeshBuilder& mesh, const Vector3f& base, float yaw_rad) {
  for (const float x : {-0.7f, 0.7f}) {
    mesh.Box(base + Turned(x, 0.0f, 0.0f, yaw_rad), {0.08f, 0.45f, 0.42f}, yaw_rad, kMetal);
  }
  mesh.Box(base + Turned(0.0f, 0.0f, 0.42f, yaw_rad), {1.8f, 0.48f, 0.05f}, yaw_rad, kWood);
  mesh.Box(base + Turned(0.0f, 0.24f, 0.55f, yaw_rad), {1.8f, 0.05f, 0.35f}, yaw_rad, kWood);
}

void AddLampPost(MeshBuilder& mesh, const Vector3f& base, float height) {
  mesh.Cylinder(base, 0.16f, 0.12f, 0.5f, 12, kMetal);
  mesh.Cylinder(base, 0.07f, 0.05f, height, 10, kMetal);
  mesh.Ellipsoid(
      base + Vector3f(0.0f, 0.0f, height + 0.2f), {0.22f, 0.22f, 0.28f}, 2, 2.0f * kMetal);
}

void AddBollard(MeshBuilder& mesh, const Vector3f& base) {
  mesh.Cylinder(base, 0.12f, 0.10f, 0.85f, 12, kStone);
  mesh.Ellipsoid(base + Vector3f(0.0f, 0.0f, 0.85f), {0.12f, 0.12f, 0.12f}, 2, kStone);
}

void AddFountain(MeshBuilder& mesh, const Vector3f& base) {
  constexpr int kSides = 24;
  const auto at = [&](float z) -> Vector3f { return base + Vector3f(0.0f, 0.0f, z); };
  mesh.Cylinder(at(-0.2f), 2.2f, 2.2f, 0.37f, 8, kStone);  // octagonal
  mesh.Cylinder(at(0.0f), 1.8f, 1.8f, 0.34f, 8, kStone);
  mesh.Cylinder(at(0.34f), 1.30f, 1.45f, 0.55f, kSides, kStone);
  mesh.Cylinder(at(0.8f), 0.32f, 0.24f, 1.3f, kSides, kStone);
  mesh.Cylinder(at(1.9f), 0.15f, 0.75f, 0.25f, kSides, kStone);
  mesh.Ellipsoid(at(2.75f), {0.28f, 0.36f, 0.65f}, 3, kStone);  // the figure: body, head, arm
  mesh.Ellipsoid(at(3.55f), {0.18f, 0.18f, 0.22f}, 3, kStone);
  mesh.Box(at(2.95f) + Vector3f(0.25f, 0.2f, 0.0f), {0.7f, 0.12f, 0.12f}, 0.6f, kStone);
}

void AddParkedCar(MeshBuilder& mesh, const Vector3f& base, float yaw_rad) {
  constexpr float kPaint = 0.35f;
  const auto at = [&](float x, float y, float z) -> Vector3f {
    return base + Turned(x, y, z, yaw_rad);
  };
  mesh.Box(at(0.0f, 0.0f, 0.25f), {4.2f, 1.75f, 0.6f}, yaw_rad, kPaint);
  mesh.Box(at(-0.3f, 0.0f, 0.85f), {2.2f, 1.55f, 0.6f}, yaw_rad, kPaint);
  for (const float x : {-1.3f, 1.3f}) {
    for (const float y : {-0.75f, 0.75f}) {
      mesh.Box(at(x, y, 0.0f), {0.6f, 0.2f, 0.6f}, yaw_rad, 0.1f);
    }
  }
}

std::vector<Opening> MakeWindows(const WindowGrid& grid,
                                 const std::vector<Opening>& others,
                                 Rng& rng) {
  std::vector<Opening> windows;
  for (const float sill : grid.sills_m) {
    for (int i = 0; i < grid.count; ++i) {
      const float u = grid.first_u + grid.pitch_m * static_cast<float>(i);
      const Opening window{
          u, u + grid.width_m, sill, sill + grid.height_m, Draw(rng, 0.15f, 0.25f), false, 0.1f};
      const auto touches = [&](const Opening& other) {
        return window.u_low <= other.u_high && other.u_low <= window.u_high &&
               window.z_low <= other.z_high && other.z_low <= window.z_high;
      };
      if (std::none_of(others.begin(), others.end(), touches)) windows.push_back(window);
    }
  }
  return windows;
}

void AddWindowFrames(MeshBuilder& mesh, const Panel& panel, const std::vector<Opening>& windows) {
  constexpr float kBar = 0.03f;  // half width
  const float yaw_rad = std::atan2(panel.along.y(), panel.along.x());
  for (const Opening& window : windows) {
    const float u = 0.5f * (window.u_low + window.u_high);
    const float z = window.z_low + 0.65f * (window.z_high - window.z_low);
    const float depth = window.depth - 0.05f;
    mesh.Quad(panel.At(u - kBar, window.z_low, depth),
              panel.At(u + kBar, window.z_low, depth),
              panel.At(u + kBar, window.z_high, depth),
              panel.At(u - kBar, window.z_high, depth),
              kWood);
    mesh.Quad(panel.At(window.u_low, z - kBar, depth),
              panel.At(window.u_high, z - kBar, depth),
              panel.At(window.u_high, z + kBar, depth),
              panel.At(window.u_low, z + kBar, depth),
              kWood);
    mesh.Box(panel.At(u, window.z_low - 0.1f, -0.06f),
             {window.u_high - window.u_low + 0.3f, 0.12f, 0.1f},
             yaw_rad,
             kStone);
  }
}

}  // namespace covsplat
