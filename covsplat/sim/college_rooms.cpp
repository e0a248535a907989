#include "covsplat/sim/college_rooms.hpp"

#include <cmath>
#include <numbers>

#include "covsplat/sim/buildings.hpp"
#include "covsplat/sim/college.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kHalfTurn = std::numbers::pi_v<float>;
constexpr float kPlaster = 0.75f;
constexpr float kWood = 0.3f;
constexpr float kStone = 0.55f;
constexpr float kThickness = 0.5f;  // of the wall to the court
constexpr float kSouth = -7.5f;     // y of the rooms' far wall
constexpr float kNorth = -kThickness;
constexpr float kHallWest = 3.5f;
constexpr float kHallEast = 11.0f;
constexpr float kParlourWest = 11.4f;
constexpr float kParlourEast = 16.5f;
constexpr float kCeiling = 4.2f;

struct Room {
  float west = 0.0f;
  float east = 0.0f;
};

// Tall windows towards the garden, recessed deeply.
void AddGardenWall(MeshBuilder& mesh, const Room& room, Rng& rng) {
  const Panel wall{{room.west, kSouth, 0.0f}, Vector3f::UnitX(), Vector3f::UnitY()};
  const float width = room.east - room.west;
  const int count = static_cast<int>(width / 2.4f);
  const float pitch = width / static_cast<float>(count);
  WindowGrid grid{0.5f * (pitch - 1.3f), pitch, count, 1.3f, 2.2f, {1.0f}};
  AddFacade(mesh, wall, {width, CollegePlan::kFoundation, kCeiling}, {}, grid, kPlaster, rng);
}

// Floor, and a ceiling with beams across.
void AddFloorAndCeiling(MeshBuilder& mesh, const Room& room) {
  for (const float z : {0.0f, kCeiling}) {
    mesh.Quad({room.west, kSouth, z},
              {room.east, kSouth, z},
              {room.east, kNorth, z},
              {room.west, kNorth, z},
              z > 0.0f ? kPlaster : kWood);
  }
  const float middle = 0.5f * (kSouth + kNorth);
  for (float x = room.west + 0.8f; x < room.east; x += 1.5f) {
    mesh.Box({x, middle, kCeiling - 0.25f}, {0.2f, kNorth - kSouth, 0.25f}, 0.0f, kWood);
  }
}

Panel DividingWall() { return {{kHallEast, kSouth, 0.0f}, Vector3f::UnitY(), -Vector3f::UnitX()}; }

// Between the rooms, with the door in the middle of it.
void AddDividingWall(MeshBuilder& mesh) {
  const float depth = kParlourWest - kHallEast;
  const WallSize size{kNorth - kSouth, CollegePlan::kFoundation, kCeiling};
  const std::vector<Opening> door = {
      {-4.6f - kSouth, -3.2f - kSouth, 0.0f, 2.3f, depth, true, 0.0f}};
  mesh.Wall(DividingWall(), size.width, size.z_low, size.z_high, door, kPlaster);
  AddRearFace(mesh, DividingWall(), size, depth, door, kPlaster);
}

void AddTable(MeshBuilder& mesh, const Vector3f& base, float length) {
  mesh.Box(base + Vector3f(0.0f, 0.0f, 0.7f), {length, 0.8f, 0.05f}, 0.0f, kWood);
  for (const float x : {-0.4f * length, 0.4f * length}) {
    for (const float y : {-0.3f, 0.3f}) {
      mesh.Box(base + Vector3f(x, y, 0.0f), {0.08f, 0.08f, 0.7f}, 0.0f, kWood);
    }
  }
  for (const float y : {-0.65f, 0.65f}) {  // benches
    mesh.Box(base + Vector3f(0.0f, y, 0.4f), {length, 0.28f, 0.04f}, 0.0f, kWood);
    for (const float x : {-0.4f * length, 0.4f * length}) {
      mesh.Box(base + Vector3f(x, y, 0.0f), {0.06f, 0.24f, 0.4f}, 0.0f, kWood);
    }
  }
}

// Shelves with books of all thicknesses and depths, facing +y.
void AddBookcase(MeshBuilder& mesh, const Vector3f& base, float yaw_rad, Rng& rng) {
  constexpr float kWidth = 1.6f;
  const Vector3f along(std::cos(yaw_rad), std::sin(yaw_rad), 0.0f);
  const Vector3f ahead(-std::sin(yaw_rad), std::cos(yaw_rad), 0.0f);
  for (int shelf = 0; shelf < 6; ++shelf) {
    const float z = 0.08f + 0.36f * static_cast<float>(shelf);
    mesh.Box(base + Vector3f(0.0f, 0.0f, z - 0.03f), {kWidth, 0.32f, 0.03f}, yaw_rad, kWood);
    for (float u = -0.5f * kWidth + 0.05f; u < 0.5f * kWidth - 0.1f;) {
      const auto thickness = static_cast<float>(rng.Uniform(0.03, 0.09));
      const auto height = static_cast<float>(rng.Uniform(0.2, 0.31));
      const auto back = static_cast<float>(rng.Uniform(-0.06, 0.02));
      const auto shade = static_cast<float>(rng.Uniform(0.15, 0.6));
      mesh.Box(base + (u + 0.5f * thickness) * along + back * ahead + Vector3f(0.0f, 0.0f, z),
               {thickness, 0.2f, height},
               yaw_rad,
               shade);
      u += thickness + 0.004f;
    }
  }
  for (const float u : {-0.5f * kWidth, 0.5f * kWidth}) {
    mesh.Box(base + u * along, {0.04f, 0.34f, 2.2f}, yaw_rad, kWood);
  }
}

void FurnishHall(MeshBuilder& mesh) {
  AddTable(mesh, {8.6f, -1.9f, 0.0f}, 3.4f);
  AddTable(mesh, {7.4f, -6.2f, 0.0f}, 5.2f);
  // The fireplace on the west wall.
  mesh.Box({kHallWest + 0.2f, -2.2f, 0.0f}, {0.4f, 0.3f, 1.2f}, 0.0f, kStone);
  mesh.Box({kHallWest + 0.2f, -0.9f, 0.0f}, {0.4f, 0.3f, 1.2f}, 0.0f, kStone);
  mesh.Box({kHallWest + 0.25f, -1.55f, 1.2f}, {0.5f, 1.9f, 0.3f}, 0.0f, kStone);
  mesh.Box({kHallWest + 0.15f, -1.55f, 1.5f}, {0.3f, 1.2f, 2.7f}, 0.0f, kStone);
}

void FurnishParlour(MeshBuilder& mesh, Rng& rng) {
  AddBookcase(mesh, {kParlourEast - 0.2f, -2.2f, 0.0f}, 0.5f * kHalfTurn, rng);
  AddBookcase(mesh, {kParlourEast - 0.2f, -4.0f, 0.0f}, 0.5f * kHalfTurn, rng);
  AddBookcase(mesh, {12.4f, kNorth - 0.2f, 0.0f}, kHalfTurn, rng);
  AddTable(mesh, {13.4f, -6.4f, 0.0f}, 1.8f);
  mesh.Cylinder({kParlourEast - 0.6f, -6.8f, 0.0f}, 0.25f, 0.3f, 0.5f, 12, kStone);
  AddHedge(mesh, {kParlourEast - 0.6f, -6.8f, 0.5f}, {0.5f, 0.5f, 0.9f}, 0.0f, rng);  // a plant
}

}  // namespace

std::vector<Opening> CollegeRoomDoors() {
  return {{4.9f, 6.3f, 0.0f, 2.4f, kThickness, true, 0.0f},
          {13.9f, 15.3f, 0.0f, 2.4f, kThickness, true, 0.0f}};
}

void AddCollegeRooms(MeshBuilder& mesh, Rng& rng) {
  const Panel court{Vector3f::Zero(), Vector3f::UnitX(), Vector3f::UnitY()};
  AddRearFace(mesh,
              court,
              {CollegePlan::kFirstWidth, CollegePlan::kFoundation, kCeiling},
              kThickness,
              CollegeRoomDoors(),
              kPlaster);
  for (const Room& room : {Room{kHallWest, kHallEast}, Room{kParlourWest, kParlourEast}}) {
    AddFloorAndCeiling(mesh, room);
    AddGardenWall(mesh, room, rng);
  }
  AddDividingWall(mesh);
  for (const float x : {kHallWest, kParlourEast}) {
    mesh.Quad({x, kSouth, CollegePlan::kFoundation},
              {x, kNorth, CollegePlan::kFoundation},
              {x, kNorth, kCeiling},
              {x, kSouth, kCeiling},
              kPlaster);
  }
  FurnishHall(mesh);
  FurnishParlour(mesh, rng);
}

}  // namespace covsplat
