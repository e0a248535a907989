// MeshOfMap: the surface of a map of Gaussians as triangles.
#pragma once

#include <functional>
#include <span>

#include "covsplat/core/trajectory.hpp"
#include "covsplat/core/triangle_mesh.hpp"
#include "covsplat/mesh/mesh_config.hpp"
#include "covsplat/mesh/surfel_map.hpp"

namespace covsplat {

struct MeshProgress {
  std::size_t done = 0;  ///< views fused, tile by tile
  std::size_t total = 0;
};

struct MeshResult {
  TriangleMesh mesh;     ///< map frame, with normals
  double voxel_m = 0.0;  ///< that was used
  std::size_t views = 0;
  std::size_t tiles = 0;
  bool interrupted = false;  ///< then the mesh is empty
};

/// The keyframes, then poses of the trajectory that are `spacing_m` or more from all views before.
std::vector<SE3> ChooseViews(const SurfelMap& map, const Trajectory& trajectory, double spacing_m);

/// Renders the map from the views, fuses what they see into a signed distance field and contours
/// it. `sensor` is the one that made the map. The result depends on neither the number of threads
/// nor the tiles. `on_progress` is called after every view; false stops. Errors: no surface
/// anywhere, voxels too small for the extent.
Result<MeshResult> MeshOfMap(const SurfelMap& map,
                             std::span<const SE3> T_map_view,
                             const SensorModel& sensor,
                             Backend backend,
                             const RasterConfig& raster,
                             const MeshConfig& config,
                             const std::function<bool(const MeshProgress&)>& on_progress);

}  // namespace covsplat
