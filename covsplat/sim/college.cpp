#include "covsplat/sim/college.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/buildings.hpp"
#include "covsplat/sim/college_rooms.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using P = CollegePlan;

constexpr float kStone = 0.6f;
constexpr float kRender = 0.7f;
constexpr float kBrick = 0.4f;
constexpr float kPaving = 0.5f;
constexpr float kGrass = 0.35f;
constexpr float kQuarter = 0.5f * std::numbers::pi_v<float>;

Panel SouthWall(float west, float y) {
  return {{west, y, 0.0f}, Vector3f::UnitX(), Vector3f::UnitY()};
}
Panel NorthWall(float west, float y) {
  return {{west, y, 0.0f}, Vector3f::UnitX(), -Vector3f::UnitY()};
}
Panel WestWall(float x, float south) {
  return {{x, south, 0.0f}, Vector3f::UnitY(), Vector3f::UnitX()};
}
Panel EastWall(float x, float south) {
  return {{x, south, 0.0f}, Vector3f::UnitY(), -Vector3f::UnitX()};
}

// Flagstones, a little uneven.
void AddPaving(MeshBuilder& mesh, const Vector2f& low, const Vector2f& high) {
  const auto height = [](float x, float y) {
    return 0.012f * std::sin(1.1f * x + 0.3f) * std::cos(0.9f * y);
  };
  const auto shade = [](float x, float y) {
    const auto stone = static_cast<int>(std::floor(x / 0.9f) + 5.0f * std::floor(y / 0.9f));
    return kPaving + 0.02f * static_cast<float>(stone % 5);
  };
  mesh.HeightField(low, high, 0.6f, height, shade);
}

void AddLawn(MeshBuilder& mesh, const Vector2f& low, const Vector2f& high, Rng& rng) {
  const auto height = [&](float, float) {
    return 0.09f + static_cast<float>(0.012 * rng.Normal());
  };
  mesh.HeightField(low, high, 0.25f, height, [](float, float) { return kGrass; });
  const Vector2f middle = 0.5f * (low + high);
  const Vector2f size = high - low;
  for (const float side : {-0.5f, 0.5f}) {
    mesh.Box(
        {middle.x(), middle.y() + side * size.y(), -0.1f}, {size.x(), 0.14f, 0.24f}, 0, kStone);
    mesh.Box(
        {middle.x() + side * size.x(), middle.y(), -0.1f}, {0.14f, size.y(), 0.24f}, 0, kStone);
  }
}

void AddButtresses(MeshBuilder& mesh, const Panel& wall, const std::vector<float>& at, float yaw) {
  for (const float u : at) {
    mesh.Box(wall.At(u, P::kFoundation, -0.3f), {0.6f, 0.6f, 3.4f}, yaw, kStone);
    mesh.Box(wall.At(u, 2.9f, -0.18f), {0.5f, 0.36f, 2.6f}, yaw, kStone);
  }
}

// The passage's own walls and ceiling come with the opening in the first court's east wall.
Opening Passage(float south, float depth) {
  return {P::kPassageLow - south, P::kPassageHigh - south, P::kFoundation, 3.0f, depth, true, 0.0f};
}

void AddFirstCourt(MeshBuilder& mesh, Rng& rng) {
  AddPaving(mesh, {0.0f, 0.0f}, {P::kSecondWest, P::kFirstDepth});
  const Panel south = SouthWall(0.0f, 0.0f);
  AddFacade(mesh,
            south,
            {P::kFirstWidth, P::kFoundation, 8.0f},
            CollegeRoomDoors(),
            {1.2f, 2.7f, 8, 1.2f, 1.8f, {1.0f, 5.2f}},
            kBrick,
            rng);
  AddButtresses(mesh, south, {3.5f, 9.8f, 17.6f}, 0.0f);
  AddRoof(mesh, south, P::kFirstWidth, 8.0f, 5.0f, 3.6f);
  const Panel north = NorthWall(0.0f, P::kFirstDepth);
  AddFacade(mesh,
            north,
            {P::kFirstWidth, P::kFoundation, 10.0f},
            {Door(10.0f, 1.9f, -0.2f, 3.0f)},
            {1.0f, 3.4f, 6, 1.5f, 3.4f, {1.4f, 6.0f}},
            kStone,
            rng);  // the chapel
  AddButtresses(mesh, north, {3.5f, 6.9f, 13.7f, 17.1f, 20.5f}, 0.0f);
  const Panel west = WestWall(0.0f, 0.0f);
  AddFacade(mesh,
            west,
            {P::kFirstDepth, P::kFoundation, 9.0f},
            {Door(12.4f, 1.3f, -0.2f, 2.5f)},
            {0.9f, 2.5f, 6, 1.1f, 1.6f, {1.1f, 4.1f, 7.0f}},
            kRender,
            rng);
  mesh.Box(west.At(6.0f, 3.4f, -0.4f), {1.8f, 0.8f, 2.8f}, kQuarter, kStone);  // an oriel
  const Panel east = EastWall(P::kFirstWidth, 0.0f);
  const float depth = P::kSecondWest - P::kFirstWidth;
  AddFacade(mesh,
            east,
            {P::kFirstDepth, P::kFoundation, 9.5f},
            {Passage(0.0f, depth)},
            {1.3f, 3.0f, 5, 1.2f, 1.8f, {1.2f, 5.0f}},
            kRender,
            rng);
  for (const float y : {P::kPassageLow - 0.9f, P::kPassageHigh + 0.9f}) {  // gate towers
    mesh.Cylinder({P::kFirstWidth, y, P::kFoundation}, 0.6f, 0.6f, 12.0f, 10, kStone);
    mesh.Cylinder({P::kFirstWidth, y, 11.5f}, 0.75f, 0.05f, 1.6f, 10, kStone);
  }
  mesh.Box(east.At(8.6f, 3.3f, -0.08f), {3.0f, 0.2f, 0.3f}, kQuarter, kStone);
}

void AddSecondCourt(MeshBuilder& mesh, Rng& rng) {
  const float width = P::kSecondEast - P::kSecondWest;
  const float length = P::kSecondNorth - P::kSecondSouth;
  AddPaving(mesh, {P::kSecondWest, P::kSecondSouth}, {P::kSecondEast, P::kSecondNorth});
  AddFacade(mesh,
            WestWall(P::kSecondWest, P::kSecondSouth),
            {length, P::kFoundation, 8.5f},
            {Passage(P::kSecondSouth, 0.0f)},
            {1.0f, 2.9f, 5, 1.2f, 1.7f, {1.2f, 5.0f}},
            kBrick,
            rng);
  AddFacade(mesh,
            SouthWall(P::kSecondWest, P::kSecondSouth),
            {width, P::kFoundation, 6.5f},
            {Door(8.2f, 1.4f, -0.2f, 2.5f)},
            {0.8f, 2.4f, 7, 1.0f, 1.5f, {1.1f, 4.2f}},
            kRender,
            rng);
  AddFacade(mesh,
            EastWall(P::kSecondEast, P::kSecondSouth),
            {length, P::kFoundation, 11.0f},
            {Door(3.0f, 1.3f, -0.2f, 2.4f)},
            {1.4f, 3.6f, 4, 1.6f, 2.4f, {1.2f, 4.9f, 8.2f}},
            kStone,
            rng);
  AddFacade(mesh,
            NorthWall(P::kSecondWest, P::kSecondNorth),
            {width, P::kFoundation, 9.5f},
            {Door(8.0f, 2.0f, P::kTerraceZ, 2.9f)},
            {1.5f, 3.1f, 5, 1.4f, 2.3f, {2.2f, 5.8f}},
            kBrick,
            rng);
  mesh.Box({37.0f, P::kSecondNorth - 0.1f, 9.0f}, {width, 0.4f, 0.3f}, 0.0f, kStone);  // cornice
}

void AddTerrace(MeshBuilder& mesh) {
  const float middle_x = 0.5f * (P::kTerraceWest + P::kTerraceEast);
  const float middle_y = 0.5f * (P::kTerraceSouth + P::kSecondNorth);
  const Vector3f size(P::kTerraceEast - P::kTerraceWest,
                      P::kSecondNorth - P::kTerraceSouth,
                      P::kTerraceZ - P::kFoundation);
  mesh.Box({middle_x, middle_y, P::kFoundation}, size, 0.0f, kStone);
  AddRailing(mesh,
             {P::kTerraceWest, P::kTerraceSouth + 0.1f, P::kTerraceZ},
             {P::kTerraceEast, P::kTerraceSouth + 0.1f, P::kTerraceZ},
             0.95f,
             kStone);
  const Stairs stairs{6, P::kTerraceZ / 6.0f, 0.3f, 2.4f, 0.0f};
  const float landing = 6.0f * 0.3f;
  // Both flights keep to the terrace's front; the wall on their north closes them off.
  const float north = P::kTerraceSouth + 2.6f;
  AddStairs(mesh,
            {{P::kTerraceWest - landing, north, 0.0f}, Vector3f::UnitX(), -Vector3f::UnitY()},
            stairs,
            kStone);
  AddStairs(mesh,
            {{P::kTerraceEast + landing, north, 0.0f}, -Vector3f::UnitX(), -Vector3f::UnitY()},
            stairs,
            kStone);
}

void AddFurniture(MeshBuilder& mesh, Rng& rng) {
  AddLawn(mesh, {5.2f, 4.6f}, {16.6f, 12.2f}, rng);
  AddLawn(mesh, {33.6f, 5.0f}, {42.6f, 10.2f}, rng);
  AddTree(mesh, {7.6f, 9.6f, 0.09f}, 6.0f, 1.9f, rng);
  AddTree(mesh, {13.9f, 6.6f, 0.09f}, 5.0f, 1.5f, rng);
  AddTree(mesh, {40.3f, 7.4f, 0.09f}, 6.4f, 1.9f, rng);
  AddFountain(mesh, {36.2f, 7.6f, 0.09f});
  AddHedge(mesh, {10.9f, 4.9f, 0.0f}, {5.0f, 0.6f, 0.9f}, 0.0f, rng);
  AddHedge(mesh, {0.7f, 3.2f, 0.0f}, {0.8f, 3.0f, 1.1f}, 0.0f, rng);
  AddHedge(mesh, {33.2f, 15.9f, P::kTerraceZ}, {1.8f, 0.7f, 0.8f}, 0.0f, rng);
  AddBench(mesh, {0.6f, 9.0f, 0.0f}, kQuarter);
  AddBench(mesh, {10.0f, 12.0f, 0.09f}, 0.0f);
  AddBench(mesh, {45.4f, 8.6f, 0.0f}, -kQuarter);
  AddBench(mesh, {37.1f, 15.8f, P::kTerraceZ}, 0.0f);
  AddLampPost(mesh, {15.4f, 12.6f, 0.0f}, 3.6f);
  AddLampPost(mesh, {43.4f, 10.6f, 0.0f}, 3.6f);
  AddLampPost(mesh, {31.4f, 2.2f, 0.0f}, 3.6f);
  for (const float y : {6.4f, 10.8f}) AddBollard(mesh, {20.6f, y, 0.0f});
}

}  // namespace

WorldMesh MakeCollege(int seed) {
  Rng rng(static_cast<std::uint64_t>(seed));
  MeshBuilder mesh;
  AddFirstCourt(mesh, rng);
  AddSecondCourt(mesh, rng);
  AddTerrace(mesh);
  AddCollegeRooms(mesh, rng);
  AddFurniture(mesh, rng);
  return std::move(mesh).Take();
}

Route CollegeRoute() {
  const std::vector<Eigen::Vector3d> corners = {
      {19.0, 8.6, 0.0},  {19.0, 4.0, 0.0},           {14.6, 2.4, 0.0},
      {14.6, -3.9, 0.0}, {5.6, -3.9, 0.0},           {5.6, 2.6, 0.0},
      {2.8, 5.0, 0.0},   {2.8, 12.0, 0.0},           {5.0, 14.2, 0.0},
      {16.0, 14.2, 0.0}, {18.8, 11.6, 0.0},          {20.4, 8.6, 0.0},
      {29.8, 8.6, 0.0},  {31.8, 5.6, 0.0},           {34.5, 3.2, 0.0},
      {42.0, 3.2, 0.0},  {44.3, 6.0, 0.0},           {44.6, 12.0, 0.0},
      {44.1, 13.1, 0.0}, {42.1, 13.1, P::kTerraceZ}, {32.1, 13.1, P::kTerraceZ},
      {30.1, 13.1, 0.0}, {29.6, 10.0, 0.0},          {29.2, 8.6, 0.0},
      {20.4, 8.6, 0.0}};
  Route route;
  route.controls = AlongLines(corners, true, 1.0);
  return route;
}

}  // namespace covsplat
