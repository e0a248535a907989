// The plan of a street and of the block that four of them go round, the parts of "street" and
// "city".
#pragma once

#include <vector>

#include <Eigen/Core>

namespace covsplat {

/// Distances in metres; those across a street count from its centre line.
struct StreetPlan {
  static constexpr float kLength = 200.0f;  // of a block along x, between centre lines
  static constexpr float kWidth = 115.0f;   // along y
  static constexpr float kLane = 1.6f;      // middle of a lane
  static constexpr float kParked = 4.4f;    // middle of the parking bays
  static constexpr float kKerb = 5.5f;
  static constexpr float kHouses = 10.0f;
  static constexpr float kHouseDepth = 9.0f;
  static constexpr float kKerbHeight = 0.13f;
  static constexpr float kBeyond = 45.0f;  // the ground ends
};

/// Height in metres of the road.
double StreetGround(double x, double y);

/// A closed way round a block whose south-west crossing is at `origin`, `offset_m` outside the
/// centre lines of its streets (negative: inside), with corners of `corner_radius_m`,
/// counter-clockwise.
std::vector<Eigen::Vector3d> StreetRing(const Eigen::Vector2d& origin,
                                        double offset_m,
                                        double corner_radius_m);

}  // namespace covsplat
