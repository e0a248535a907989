// ScreenedPoisson: the only place that knows the library that solves it.
#pragma once

#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat {

/// Points on surfaces, each with the unit normal to the front.
struct OrientedPoints {
  std::vector<Eigen::Vector3d> points;   ///< [N] m
  std::vector<Eigen::Vector3d> normals;  ///< [N]
};

/// A surface through the points, with normals, closed as far as they go round (Kazhdan and Hoppe,
/// ACM TOG 2013). `depth`: the octree halves the points' cube so many times. kUnavailable if this
/// build is without Open3D.
Result<TriangleMesh> ScreenedPoisson(const OrientedPoints& points, int depth, int threads);

}  // namespace covsplat
