// Small meshes with known geometry.
#pragma once

#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat::test {

/// Adds a parallelogram as two triangles.
inline void AddQuad(const Eigen::Vector3f& corner,
                    const Eigen::Vector3f& u,
                    const Eigen::Vector3f& v,
                    TriangleMesh& mesh) {
  const int first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {corner, corner + u, corner + u + v, corner + v});
  mesh.triangles.emplace_back(first, first + 1, first + 2);
  mesh.triangles.emplace_back(first, first + 2, first + 3);
}

/// A horizontal rectangle from (x, y) with the given sides, at height z.
inline TriangleMesh Plane(float x, float y, float width, float depth, float z) {
  TriangleMesh mesh;
  AddQuad({x, y, z}, {width, 0.0f, 0.0f}, {0.0f, depth, 0.0f}, mesh);
  return mesh;
}

/// The six sides of an axis-aligned box.
inline TriangleMesh BoxMesh(const Eigen::Vector3f& low, const Eigen::Vector3f& size) {
  const Eigen::Vector3f x(size.x(), 0.0f, 0.0f), y(0.0f, size.y(), 0.0f), z(0.0f, 0.0f, size.z());
  TriangleMesh mesh;
  for (const Eigen::Vector3f& corner : {low, Eigen::Vector3f(low + z)}) AddQuad(corner, x, y, mesh);
  for (const Eigen::Vector3f& corner : {low, Eigen::Vector3f(low + y)}) AddQuad(corner, x, z, mesh);
  for (const Eigen::Vector3f& corner : {low, Eigen::Vector3f(low + x)}) AddQuad(corner, y, z, mesh);
  return mesh;
}

}  // namespace covsplat::test
