// Voxels in the order of their first use, and points thinned to one per voxel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace covsplat {

/// A grid whose corners lie at whole multiples of the edge. Cells further than 2^20 edges from the
/// origin (21 km at 2 cm) are outside.
struct VoxelGrid {
  double edge_m = 0.02;

  /// One number for the cell of a point; nothing if it is outside or not finite.
  std::optional<std::uint64_t> KeyOf(const Eigen::Vector3d& point) const;
  static std::uint64_t KeyOfCell(const Eigen::Vector3i& cell);
  static Eigen::Vector3i CellOf(std::uint64_t key);
  Eigen::Vector3d CenterOf(std::uint64_t key) const;
};

/// Numbers keys 0, 1, 2, ... in the order in which they come.
class VoxelIndex {
 public:
  std::size_t Insert(std::uint64_t key);
  bool Contains(std::uint64_t key) const;
  std::size_t Size() const { return keys_.size(); }
  std::span<const std::uint64_t> Keys() const { return keys_; }

 private:
  std::size_t SlotOf(std::uint64_t key) const;
  void Grow();

  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> slots_;  // 1 + number of the key, 0 where free; a power of two of them
};

/// The mean of the points of each voxel, in the order in which the voxels came.
class VoxelMeans {
 public:
  explicit VoxelMeans(const VoxelGrid& grid) : grid_(grid) {}

  /// Points outside the grid do not count.
  void Add(const Eigen::Vector3d& point);
  std::vector<Eigen::Vector3d> Means() const;

 private:
  VoxelGrid grid_;
  VoxelIndex index_;
  std::vector<Eigen::Vector3d> sums_;
  std::vector<std::uint32_t> counts_;
};

}  // namespace covsplat
