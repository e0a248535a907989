// TriangleMesh: a surface made of triangles.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace covsplat {

/// Triangles over shared vertices; corners run counter-clockwise seen from the front, where a side
/// has a meaning at all.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;      ///< [V] m
  std::vector<Eigen::Vector3i> triangles;     ///< [T] indices of vertices
  std::vector<Eigen::Vector3f> normals = {};  ///< [V] unit, to the front; or empty: not known
};

}  // namespace covsplat
