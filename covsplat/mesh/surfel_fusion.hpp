// Surfel fusion: the discs of the Gaussians themselves into the signed distance field.
#pragma once

#include "covsplat/mesh/mesh_config.hpp"
#include "covsplat/mesh/surfel_map.hpp"
#include "covsplat/mesh/voxel_grid.hpp"

namespace covsplat {

/// Adds the plane of every Gaussian to the voxels about its disc, with a weight that falls off like
/// the Gaussian: where views see a surface flatly or through sparse discs, its Gaussians still tell
/// where it is; elsewhere the many views outweigh them. Voxels in the gaps between discs get the
/// mean of the planes around them. The sums come out the same for any number of threads and any
/// choice of blocks.
void FuseSurfels(const SurfelMap& map, const MeshConfig& config, VoxelGrid& grid, ThreadPool& pool);

}  // namespace covsplat
