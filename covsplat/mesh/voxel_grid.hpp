// VoxelGrid: a signed distance field where there are surfaces, in blocks of 8 x 8 x 8 voxels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace covsplat {

inline constexpr int kBlockSide = 8;
inline constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

/// Block (i, j, k) holds voxels [8 i, 8 i + 8) x ...; voxel (x, y, z) samples the field at
/// (x, y, z) * voxel_m in the map frame. Blocks are in order of z, then y, then x.
using BlockIndex = Eigen::Vector3i;
bool BlockOrder(const BlockIndex& a, const BlockIndex& b);

/// Weighted sums of what the views say.
struct Voxel {
  float weight = 0.0f;
  float distance = 0.0f;  ///< sum of weight * signed distance in voxels, positive in the open
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< sum of weight * normal, map frame

  float Distance() const { return distance / weight; }
};

/// Position of a voxel in its block's array.
constexpr int VoxelInBlock(int x, int y, int z) { return x + kBlockSide * (y + kBlockSide * z); }

/// Blocks at chosen places, all voxels empty at first.
class VoxelGrid {
 public:
  /// `blocks` in BlockOrder, without doubles.
  VoxelGrid(double voxel_m, std::vector<BlockIndex> blocks);

  double VoxelSize() const { return voxel_m_; }
  std::size_t Size() const { return blocks_.size(); }
  const BlockIndex& Block(std::size_t number) const { return blocks_[number]; }
  std::span<Voxel> Voxels(std::size_t number) {
    return {&voxels_[number * kBlockVoxels], static_cast<std::size_t>(kBlockVoxels)};
  }
  std::span<const Voxel> Voxels(std::size_t number) const {
    return {&voxels_[number * kBlockVoxels], static_cast<std::size_t>(kBlockVoxels)};
  }

  /// The number of a block, or -1.
  std::int64_t Find(const BlockIndex& block) const;

 private:
  double voxel_m_;
  std::vector<BlockIndex> blocks_;
  std::vector<Voxel> voxels_;
};

}  // namespace covsplat
