#include "covsplat/mesh/map_mesher.hpp"

#include <algorithm>
#include <utility>

#include "covsplat/mesh/clean_mesh.hpp"
#include "covsplat/mesh/dual_contouring.hpp"
#include "covsplat/mesh/fusion.hpp"
#include "covsplat/mesh/surfel_fusion.hpp"
#include "covsplat/mesh/tiling.hpp"

namespace covsplat {
namespace {

/// Median and expected range on equal terms: their difference tells pixels that mix surfaces.
EngineConfig EngineFor(const RasterConfig& raster) {
  EngineConfig config;
  config.raster = raster;
  config.raster.depth_ratio = 0.5;
  return config;
}

/// Whether a view can see into a tile.
bool Reaches(const SE3& T_map_view, const Tile& tile, double block_m, double max_range_m) {
  const Eigen::Vector3d& here = T_map_view.Translation();
  return std::any_of(tile.padded.begin(), tile.padded.end(), [&](const BlockIndex& block) {
    const Eigen::Vector3d low = block_m * block.cast<double>();
    const Eigen::Vector3d nearest =
        here.cwiseMax(low).cwiseMin(low + Eigen::Vector3d::Constant(block_m));
    return (nearest - here).norm() <= max_range_m;
  });
}

/// The views of each tile, in their order.
std::vector<std::vector<SE3>> ViewsOf(const std::vector<Tile>& tiles,
                                      std::span<const SE3> T_map_view,
                                      double block_m,
                                      double max_range_m) {
  std::vector<std::vector<SE3>> views(tiles.size());
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    for (const SE3& pose : T_map_view) {
      if (Reaches(pose, tiles[t], block_m, max_range_m)) views[t].push_back(pose);
    }
  }
  return views;
}

}  // namespace

std::vector<SE3> ChooseViews(const SurfelMap& map, const Trajectory& trajectory, double spacing_m) {
  std::vector<SE3> views = map.T_map_keyframe;
  for (const TimedPose& pose : trajectory) {
    const bool is_new = std::all_of(views.begin(), views.end(), [&](const SE3& view) {
      return (view.Translation() - pose.T_world_sensor.Translation()).norm() >= spacing_m;
    });
    if (is_new) views.push_back(pose.T_world_sensor);
  }
  return views;
}

Result<MeshResult> MeshOfMap(const SurfelMap& map,
                             std::span<const SE3> T_map_view,
                             const SensorModel& sensor,
                             Backend backend,
                             const RasterConfig& raster,
                             const MeshConfig& config,
                             const std::function<bool(const MeshProgress&)>& on_progress) {
  if (map.Size() == 0) return Fail(ErrorCode::kInput, "the map has no Gaussians to make a mesh of");
  ThreadPool pool(config.threads);
  MeshResult result;
  result.voxel_m = config.voxel_m > 0.0 ? config.voxel_m : VoxelFor(map);
  result.views = T_map_view.size();
  const double margin_m =
      std::max(config.truncation_voxels + 1.0, config.bridge_voxels) * result.voxel_m;
  const auto blocks = BlocksNear(map, result.voxel_m, margin_m, pool);
  if (!blocks) return Forward(blocks);
  const std::vector<Tile> tiles = SplitIntoTiles(*blocks, config.max_tile_blocks);
  result.tiles = tiles.size();

  const ViewCamera camera(config.view);
  const SensorModel rays = camera.Sensor(sensor.MinRange(), sensor.MaxRange());
  auto engine = MakeMapEngine(map, backend, rays, EngineFor(raster), pool);
  if (!engine) return Forward(engine);
  const auto views =
      ViewsOf(tiles, T_map_view, kBlockSide * result.voxel_m, config.view.max_range_m);
  MeshProgress progress;
  for (const auto& of_tile : views) progress.total += of_tile.size();
  std::vector<SurfacePiece> pieces;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    VoxelGrid grid(result.voxel_m, tiles[t].padded);
    for (const SE3& pose : views[t]) {
      const RenderOutput render = (*engine)->Render(pose);
      const DepthView view = MakeDepthView(camera, render, pose, config.view, pool);
      FuseView(camera, view, config, grid, pool);
      ++progress.done;
      if (on_progress && !on_progress(progress)) {
        result.interrupted = true;
        return result;
      }
    }
    FuseSurfels(map, config, grid, pool);
    pieces.push_back(Contour(grid, tiles[t].own, {config.min_weight, config.sharpness}, pool));
  }
  result.mesh = JoinPieces(std::move(pieces));
  DropSmallComponents(config.min_component_m2, result.mesh);
  if (result.mesh.triangles.empty()) {
    return Fail(ErrorCode::kInput,
                "the map shows no surface from its keyframes; lower min_weight or "
                "view.min_alpha if it is very sparse");
  }
  return result;
}

}  // namespace covsplat
