#include "covsplat/mesh/poisson.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/core/nearest_points.hpp"
#include "covsplat/mesh/clean_mesh.hpp"
#include "covsplat/mesh/screened_poisson.hpp"

namespace covsplat {
namespace {

/// Beyond this many standard deviations a Gaussian hardly says where its surface is.
constexpr double kSigmas = 1.5;
constexpr double kTrimVoxels = 2.0;
/// The octree's cells grow instead, where a map is larger: 4096 of them along each side.
constexpr int kMaxDepth = 12;

/// Points over every disc, no farther apart than the spacing.
OrientedPoints PointsOnDiscs(const SurfelMap& map, double spacing_m) {
  OrientedPoints cloud;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const SurfelDisc disc = DiscOf(map, i);
    const double reach_u = 0.5 * kSigmas * disc.radius_u;
    const double reach_v = 0.5 * kSigmas * disc.radius_v;
    const int steps_u = static_cast<int>(std::ceil(reach_u / spacing_m));
    const int steps_v = static_cast<int>(std::ceil(reach_v / spacing_m));
    for (int a = -steps_u; a <= steps_u; ++a) {
      for (int b = -steps_v; b <= steps_v; ++b) {
        const double u = static_cast<double>(a) / std::max(1, steps_u);
        const double v = static_cast<double>(b) / std::max(1, steps_v);
        if (u * u + v * v > 1.0 + 1e-9) continue;
        cloud.points.push_back(disc.mean + u * reach_u * disc.axes.col(0) +
                               v * reach_v * disc.axes.col(1));
        cloud.normals.push_back(disc.axes.col(2));
      }
    }
  }
  return cloud;
}

/// Halvings of the points' cube down to cells of the wanted size.
int DepthFor(const OrientedPoints& cloud, double cell_m) {
  Eigen::Vector3d low = cloud.points.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& p : cloud.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double cells = std::max(1.0, (high - low).maxCoeff() / cell_m);
  return std::clamp(static_cast<int>(std::ceil(std::log2(cells))), 1, kMaxDepth);
}

/// Triangles with a corner farther than this from all points go.
void TrimFarFrom(const OrientedPoints& cloud,
                 double distance_m,
                 ThreadPool& pool,
                 TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3f& v : mesh.vertices) vertices.push_back(v.cast<double>());
  const std::vector<float> distance = NearestPoints(cloud.points).DistancesFrom(vertices, pool);
  const auto is_far = [&](int vertex) {
    return static_cast<double>(distance[static_cast<std::size_t>(vertex)]) > distance_m;
  };
  std::erase_if(mesh.triangles, [&](const Eigen::Vector3i& t) {
    return is_far(t[0]) || is_far(t[1]) || is_far(t[2]);
  });
}

}  // namespace

Result<MeshResult> PoissonOfMap(const SurfelMap& map, const MeshConfig& config) {
  if (map.Size() == 0) return Fail(ErrorCode::kInput, "the map has no Gaussians to make a mesh of");
  ThreadPool pool(config.threads);
  MeshResult result;
  result.voxel_m = config.voxel_m > 0.0 ? config.voxel_m : VoxelFor(map);
  const OrientedPoints cloud = PointsOnDiscs(map, result.voxel_m);
  Result<TriangleMesh> mesh =
      ScreenedPoisson(cloud, DepthFor(cloud, result.voxel_m), pool.Threads());
  if (!mesh) return Forward(mesh);
  TrimFarFrom(cloud, kTrimVoxels * result.voxel_m, pool, *mesh);
  DropSmallComponents(config.min_component_m2, *mesh);
  result.mesh = std::move(*mesh);
  return result;
}

}  // namespace covsplat
