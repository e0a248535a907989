// What tests ask of meshes.
#pragma once

#include <map>
#include <utility>

#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat::test {

/// How often each directed edge occurs. In an oriented surface without holes every edge occurs once
/// in either direction.
inline std::map<std::pair<int, int>, int> DirectedEdges(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  return edges;
}

inline bool IsWatertight(const TriangleMesh& mesh) {
  const auto edges = DirectedEdges(mesh);
  for (const auto& [edge, count] : edges) {
    if (count != 1) return false;
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != 1) return false;
  }
  return !edges.empty();
}

/// Greatest value of `distance(vertex)`.
template <class Distance>
double Farthest(const TriangleMesh& mesh, Distance&& distance) {
  double farthest = 0.0;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    farthest = std::max(farthest, static_cast<double>(distance(v.cast<double>().eval())));
  }
  return farthest;
}

}  // namespace covsplat::test
