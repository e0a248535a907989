#include "covsplat/mesh/screened_poisson.hpp"

#include <tuple>

#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>

namespace covsplat {

Result<TriangleMesh> ScreenedPoisson(const OrientedPoints& points, int depth, int threads) {
  open3d::geometry::PointCloud cloud;
  cloud.points_ = points.points;
  cloud.normals_ = points.normals;
  constexpr float kByDepth = 0.0f;
  constexpr float kCubeOverExtent = 1.1f;
  constexpr bool kLinearFit = false;
  const auto solved = std::get<0>(open3d::geometry::TriangleMesh::CreateFromPointCloudPoisson(
      cloud, static_cast<std::size_t>(depth), kByDepth, kCubeOverExtent, kLinearFit, threads));
  solved->ComputeVertexNormals();
  TriangleMesh mesh;
  mesh.triangles = {solved->triangles_.begin(), solved->triangles_.end()};
  for (const Eigen::Vector3d& v : solved->vertices_) mesh.vertices.push_back(v.cast<float>());
  for (const Eigen::Vector3d& n : solved->vertex_normals_) mesh.normals.push_back(n.cast<float>());
  return mesh;
}

}  // namespace covsplat
