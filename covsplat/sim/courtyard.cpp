#include "covsplat/sim/courtyard.hpp"

#include <cmath>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/courtyard_buildings.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPaving = 0.5f;
constexpr float kGrass = 0.35f;
constexpr float kStone = 0.6f;
constexpr float kDoor = 0.25f;

float Ground(float x, float y) { return static_cast<float>(CourtyardGround(x, y)); }

Vector3f OnGround(float x, float y) { return {x, y, Ground(x, y)}; }

struct Lawn {
  Vector2f low;
  Vector2f high;
};

void AddLawn(MeshBuilder& mesh, const Lawn& lawn, Rng& rng) {
  const auto height = [&](float x, float y) {
    return Ground(x, y) + 0.09f + static_cast<float>(0.012 * rng.Normal());
  };
  mesh.HeightField(lawn.low, lawn.high, 0.2f, height, [](float, float) { return kGrass; });
  const Vector2f middle = 0.5f * (lawn.low + lawn.high);
  const Vector2f size = lawn.high - lawn.low;
  constexpr float kKerb = 0.14f;
  constexpr int kStones = 6;  // per edge, so that kerbs follow the ground
  for (int i = 0; i < kStones; ++i) {
    const float s = (static_cast<float>(i) + 0.5f) / kStones - 0.5f;
    for (const float side : {-0.5f, 0.5f}) {
      const float x = middle.x() + s * size.x();
      const float y = middle.y() + s * size.y();
      const float edge_x = middle.x() + side * size.x();
      const float edge_y = middle.y() + side * size.y();
      mesh.Box(
          {x, edge_y, Ground(x, edge_y) - 0.1f}, {size.x() / kStones, kKerb, 0.24f}, 0.0f, kStone);
      mesh.Box(
          {edge_x, y, Ground(edge_x, y) - 0.1f}, {kKerb, size.y() / kStones, 0.24f}, 0.0f, kStone);
    }
  }
}

void AddGround(MeshBuilder& mesh, Rng& rng) {
  const auto paving = [](float x, float y) {
    const auto stone = static_cast<int>(std::floor(x / 1.2f) + 7.0f * std::floor(y / 1.2f));
    return kPaving + 0.02f * static_cast<float>(stone % 5);
  };
  mesh.HeightField({-45.0f, -20.0f}, {-15.0f, 20.0f}, 1.0f, Ground, paving);
  mesh.HeightField({-15.0f, -12.0f}, {15.0f, 12.0f}, 0.4f, Ground, paving);
  AddLawn(mesh, {{-8.8f, -5.2f}, {-2.2f, 5.4f}}, rng);
  AddLawn(mesh, {{5.6f, -5.6f}, {9.2f, 3.4f}}, rng);
}

void AddFurniture(MeshBuilder& mesh, Rng& rng) {
  AddFountain(mesh, OnGround(1.8f, -0.8f));
  AddTree(mesh, OnGround(-6.6f, 2.9f), 6.2f, 2.1f, rng);
  AddTree(mesh, OnGround(-4.3f, -2.6f), 5.2f, 1.8f, rng);
  AddTree(mesh, OnGround(7.6f, -3.4f), 5.6f, 1.6f, rng);
  AddTree(mesh, OnGround(7.0f, 1.6f), 4.2f, 1.2f, rng);
  AddHedge(mesh, OnGround(-8.1f, -2.2f), {0.8f, 4.2f, 1.1f}, 0.0f, rng);
  AddHedge(mesh, OnGround(0.5f, 6.2f), {3.0f, 0.7f, 0.9f}, 0.2f, rng);
  AddBench(mesh, OnGround(-1.4f, -3.4f), 1.57f);
  AddBench(mesh, OnGround(4.9f, 1.4f), -1.57f);
  AddBench(mesh, OnGround(-13.9f, -6.0f), 1.57f);
  AddBench(mesh, OnGround(1.0f, -11.3f), 3.14f);
  AddLampPost(mesh, OnGround(-9.6f, -6.2f), 4.0f);
  AddLampPost(mesh, OnGround(4.4f, 6.6f), 4.0f);
  AddLampPost(mesh, OnGround(13.8f, -2.4f), 3.4f);
  for (const float y : {1.7f, 3.1f, 4.5f}) AddBollard(mesh, OnGround(-14.2f, y));
  AddBollard(mesh, OnGround(-2.0f, -10.6f));
  mesh.Box(OnGround(-13.6f, 8.0f), {1.1f, 0.8f, 1.2f}, 0.3f, kDoor);  // a crate
}

}  // namespace

double CourtyardGround(double x, double y) {
  return 0.004 * x - 0.003 * y + 0.03 * std::sin(0.31 * x + 0.4) * std::cos(0.27 * y - 0.2) +
         0.012 * std::sin(0.9 * x - 0.7 * y);
}

WorldMesh MakeCourtyard(int seed) {
  Rng rng(static_cast<std::uint64_t>(seed));
  MeshBuilder mesh;
  AddGround(mesh, rng);
  AddCourtyardBuildings(mesh, rng);
  AddFurniture(mesh, rng);
  return std::move(mesh).Take();
}

Route CourtyardRoute() {
  Route route;
  route.controls = {{-11.4, -8.6, 0.0}, {-7.0, -8.4, 0.0}, {-2.0, -7.6, 0.0}, {3.0, -8.4, 0.0},
                    {7.5, -8.2, 0.0},   {11.2, -8.2, 0.0}, {11.4, -5.0, 0.0}, {10.8, -1.5, 0.0},
                    {10.9, 2.0, 0.0},   {10.6, 5.2, 0.0},  {8.6, 7.2, 0.0},   {7.4, 9.2, 0.0},
                    {6.0, 10.7, 0.0},   {2.5, 10.5, 0.0},  {-2.0, 10.6, 0.0}, {-5.8, 10.7, 0.0},
                    {-7.4, 9.2, 0.0},   {-9.2, 7.4, 0.0},  {-11.4, 5.0, 0.0}, {-11.8, 1.0, 0.0},
                    {-11.2, -3.0, 0.0}, {-12.2, -6.4, 0.0}};
  route.jitter_m = 0.1;
  route.ground = CourtyardGround;
  return route;
}

}  // namespace covsplat
