#include "covsplat/mesh/voxel_grid.hpp"

#include <algorithm>
#include <tuple>

namespace covsplat {

bool BlockOrder(const BlockIndex& a, const BlockIndex& b) {
  return std::make_tuple(a.z(), a.y(), a.x()) < std::make_tuple(b.z(), b.y(), b.x());
}

VoxelGrid::VoxelGrid(double voxel_m, std::vector<BlockIndex> blocks)
    : voxel_m_(voxel_m), blocks_(std::move(blocks)), voxels_(blocks_.size() * kBlockVoxels) {}

std::int64_t VoxelGrid::Find(const BlockIndex& block) const {
  const auto at = std::lower_bound(blocks_.begin(), blocks_.end(), block, BlockOrder);
  return at != blocks_.end() && *at == block ? at - blocks_.begin() : -1;
}

}  // namespace covsplat
