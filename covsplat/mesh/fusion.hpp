// Fusion: rendered views into a signed distance field.
#pragma once

#include "covsplat/mesh/depth_view.hpp"
#include "covsplat/mesh/voxel_grid.hpp"

namespace covsplat {

/// How deep behind a surface a distance still counts, as a share of the truncation.
inline constexpr double kBehindShare = 2.0 / 3.0;

/// Adds a view to every block it sees: each voxel gathers the plane of the pixel that it falls on,
/// so blocks are independent and the sums come out the same for any number of threads and any
/// choice of blocks. Nothing is said of voxels farther from a surface than the truncation: what has
/// moved on since it was measured is the mapper's to remove, who knows what scans saw.
void FuseView(const ViewCamera& camera,
              const DepthView& view,
              const MeshConfig& config,
              VoxelGrid& grid,
              ThreadPool& pool);

}  // namespace covsplat
