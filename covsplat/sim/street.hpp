// The world "street": a ring of streets, 200 by 115 m between its centre lines, round city blocks.
// The sensor drives counter-clockwise on the right, so on the outer lane.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/mover.hpp"
#include "covsplat/sim/path.hpp"

namespace covsplat {

/// Distances in metres; those across a street count from its centre line.
struct StreetPlan {
  static constexpr float kLength = 200.0f;  // along x, between centre lines
  static constexpr float kWidth = 115.0f;   // along y
  static constexpr float kLane = 1.6f;      // middle of a lane
  static constexpr float kParked = 4.4f;    // middle of the parking bays
  static constexpr float kKerb = 5.5f;
  static constexpr float kHouses = 10.0f;
  static constexpr float kKerbHeight = 0.13f;
  static constexpr float kBeyond = 45.0f;  // the ground ends
};

WorldMesh MakeStreet(int seed);

/// Height in metres of the road.
double StreetGround(double x, double y);

/// Once round, about 620 m.
Route StreetRoute();

/// Cars that come the other way on the inner lane, and people on the pavements.
std::vector<Mover> StreetTraffic(int seed);

/// A closed way round the ring, `offset_m` outside its centre lines (negative: inside), with
/// corners of `corner_radius_m`, counter-clockwise.
std::vector<Eigen::Vector3d> StreetRing(double offset_m, double corner_radius_m);

}  // namespace covsplat
