// The world "college": two courts joined by a passage, x to the east, y to the north. The first, 22
// by 17 m, has two rooms on its south side; the second, 18 by 16 m, a terrace with stairs.
#pragma once

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

WorldMesh MakeCollege(int seed);

/// Round the first court and through its rooms, through the passage, round the second court and
/// over its terrace, and back through the passage: closed, about 130 m.
Route CollegeRoute();

/// What the two files that build the college share, in metres.
struct CollegePlan {
  static constexpr float kFoundation = -0.5f;
  static constexpr float kFirstWidth = 22.0f;    // x from 0
  static constexpr float kFirstDepth = 17.0f;    // y from 0
  static constexpr float kSecondWest = 28.0f;    // x
  static constexpr float kSecondEast = 46.0f;    // x
  static constexpr float kSecondSouth = 0.5f;    // y
  static constexpr float kSecondNorth = 16.5f;   // y
  static constexpr float kPassageLow = 7.4f;     // y
  static constexpr float kPassageHigh = 9.8f;    // y
  static constexpr float kTerraceWest = 32.0f;   // x
  static constexpr float kTerraceEast = 42.2f;   // x
  static constexpr float kTerraceSouth = 11.8f;  // y
  static constexpr float kTerraceZ = 1.02f;
};

}  // namespace covsplat
