// Density image: a local map from above, and what is remarkable in it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/image.hpp"
#include "covsplat/core/se3.hpp"

namespace covsplat {

/// How much stands above each cell of the ground: pixel (i, j) is the cell `origin + (i, j)` of x
/// and y, the brightest is the one with most.
struct DensityImage {
  Image<std::uint8_t> pixels;
  Eigen::Vector2i origin = Eigen::Vector2i::Zero();  ///< cell of the first pixel
  double cell_m = 0.5;
};

/// Of points in the frame of the ground; cells with less than `min_share` of the most are black.
DensityImage DensityOf(std::span<const Eigen::Vector3f> points_ground,
                       double cell_m,
                       double min_share);

/// A remarkable spot, with what it looks like: ORB's 256 bits (Rublee et al., ICCV 2011).
struct Landmark {
  Eigen::Vector2f position_m;  ///< in the frame of the ground
  std::array<std::uint64_t, 4> bits;
};

/// Those whose looks are not repeated within the image.
std::vector<Landmark> LandmarksOf(const DensityImage& image);

/// Bits in which two differ.
int HammingDistance(const Landmark& a, const Landmark& b);

/// How one set of landmarks lies to another: a rigid motion in the plane.
struct PlaneMotion {
  double turn_rad = 0.0;
  Eigen::Vector2d translation_m = Eigen::Vector2d::Zero();
  int inliers = 0;  ///< pairs of landmarks that it brings together

  SE3 InSpace() const;
};

/// T_old_fresh by the pairs of landmarks that differ in at most `max_distance` bits: the motion
/// that brings most of them together to within `tolerance_m` (RANSAC, with a fixed seed).
PlaneMotion MatchLandmarks(std::span<const Landmark> fresh,
                           std::span<const Landmark> old,
                           int max_distance,
                           double tolerance_m);

}  // namespace covsplat
