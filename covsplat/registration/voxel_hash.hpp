// VoxelHash: which cell of a regular grid holds what, in one flat table.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace covsplat {

/// Coordinates of cells are within this, either way.
inline constexpr float kCellLimit = 1048575.0f;

/// Integer coordinates of the cell that holds a position measured in cells. Far positions and NaN
/// are clamped, so any input is safe.
inline Eigen::Vector3i CellOf(const Eigen::Vector3f& position) {
  Eigen::Vector3i cell;
  for (int axis = 0; axis < 3; ++axis) {
    const float x = position[axis];
    const float clamped = x > -kCellLimit ? (x < kCellLimit ? x : kCellLimit) : -kCellLimit;
    const int truncated = static_cast<int>(clamped);  // std::floor is a call without SSE4.1
    cell[axis] = truncated - (clamped < static_cast<float>(truncated) ? 1 : 0);
  }
  return cell;
}

/// Open-addressing table from cells to small non-negative integers. Small tables are fast ones: it
/// begins with room for `expected_cells` and grows when they were too few. Coordinates beyond
/// +-2^20 share entries with others.
class VoxelHash {
 public:
  explicit VoxelHash(std::size_t expected_cells = 0) {
    Allocate(std::bit_ceil(2 * expected_cells + 2));
  }

  /// Value of a cell, -1 if it has none.
  int Find(const Eigen::Vector3i& cell) const { return slots_[Locate(Pack(cell))].value; }

  /// Value of a cell, which becomes `fresh` if it had none.
  int FindOrInsert(const Eigen::Vector3i& cell, int fresh) {
    const std::uint64_t key = Pack(cell);
    const std::size_t at = Locate(key);
    if (slots_[at].value >= 0) return slots_[at].value;
    slots_[at] = {key, fresh};
    if (2 * ++used_ > slots_.size()) Grow();
    return fresh;
  }

 private:
  struct Slot {
    std::uint64_t key = 0;
    int value = -1;  ///< -1: free
  };

  static std::uint64_t Pack(const Eigen::Vector3i& cell) {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    return (static_cast<std::uint64_t>(cell.x()) & kMask) << 42 |
           (static_cast<std::uint64_t>(cell.y()) & kMask) << 21 |
           (static_cast<std::uint64_t>(cell.z()) & kMask);
  }

  void Allocate(std::size_t capacity) {
    shift_ = 64 - std::countr_zero(capacity);
    mask_ = capacity - 1;
    slots_.assign(capacity, Slot{});
  }

  void Grow() {
    const std::vector<Slot> old = std::exchange(slots_, {});
    Allocate(2 * old.size());
    for (const Slot& slot : old) {
      if (slot.value >= 0) slots_[Locate(slot.key)] = slot;
    }
  }

  std::size_t Locate(std::uint64_t key) const {
    std::size_t index = (key * 0x9E3779B97F4A7C15ULL) >> shift_;
    while (slots_[index].value >= 0 && slots_[index].key != key) index = (index + 1) & mask_;
    return index;
  }

  int shift_ = 0;
  std::size_t mask_ = 0;
  std::size_t used_ = 0;
  std::vector<Slot> slots_;
};

}  // namespace covsplat
