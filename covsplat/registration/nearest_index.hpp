// NearestIndex: exact nearest neighbours among fixed points, by hashed grid cells.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {

/// Cells lie in blocks of 4 x 4 x 4, of which only those with points exist: 64 cells cost one
/// look-up and the empty ones nothing more. Points are stored cell by cell; a *slot* is a point's
/// place in that order. Results do not depend on the cell size: among equally near points the one
/// with the lowest original index wins.
class NearestIndex {
 public:
  struct Match {
    int slot = -1;  ///< -1: nothing within the radius
    float squared_distance = std::numeric_limits<float>::infinity();
    /// No other point is nearer than this, m: after the query has moved by d, the match is still
    /// the nearest point if it is nearer than clearance_m - d.
    float clearance_m = 0.0f;
  };

  /// `points` must be finite. `cell_m` of about the typical neighbour distance to twice that is
  /// fastest.
  NearestIndex(std::span<const Eigen::Vector3f> points, float cell_m);

  std::size_t Size() const { return order_.size(); }
  /// Original index of the point in a slot.
  int IndexOf(int slot) const { return order_[static_cast<std::size_t>(slot)]; }

  /// Nearest point with a squared distance below `max_squared`. A `hint`, a slot that is probably
  /// near, makes it faster and changes nothing else. The search goes `margin_m` beyond the nearest
  /// point to find the clearance, which is at most that much more than the distance.
  Match Nearest(const Eigen::Vector3f& query,
                float max_squared,
                int hint = -1,
                float margin_m = 0.0f) const;

  /// Calls visit(i) with the original index of every point in the cells around a position: all that
  /// are nearer than a cell's edge are among them.
  template <class Visit>
  void ForEachAround(const Eigen::Vector3f& position, Visit&& visit) const {
    const Eigen::Vector3i home = CellOf(position * cells_per_m_);
    const Box box{home.array() - 1, home.array() + 1};
    ForEachBlock(box, [&](const Eigen::Vector3i& at) {
      const int found = block_ids_.Find(at);
      if (found < 0) return;
      const Block& block = blocks_[static_cast<std::size_t>(found)];
      ForEachCell(block, CellsWithin(box, at), [&](int, int begin, int end) {
        for (int slot = begin; slot < end; ++slot) visit(static_cast<std::size_t>(IndexOf(slot)));
      });
    });
  }

 private:
  static constexpr int kBlockEdge = 4;  // cells

  struct Block {
    std::uint64_t cells = 0;  // bit CellInBlock(cell): it has points
    int first = 0;            // position in begin_ of the first of these
  };

  // Cells, both corners included.
  struct Box {
    Eigen::Vector3i low;
    Eigen::Vector3i high;
  };

  // The two nearest points so far.
  struct Search {
    Eigen::Vector3f query;
    Eigen::Vector3f position;  // in cells
    float margin_m;
    int slot = -1;
    float squared;
    float second_squared = std::numeric_limits<float>::infinity();
  };

  static Eigen::Vector3i BlockOf(const Eigen::Vector3i& cell) {
    return {cell.x() >> 2, cell.y() >> 2, cell.z() >> 2};
  }
  static int CellInBlock(const Eigen::Vector3i& cell) {
    return (cell.x() & 3) << 4 | (cell.y() & 3) << 2 | (cell.z() & 3);
  }
  static std::uint64_t CellsWithin(const Box& box, const Eigen::Vector3i& block);

  template <class Visit>
  static void ForEachBlock(const Box& box, Visit&& visit) {
    const Eigen::Vector3i low = BlockOf(box.low);
    const Eigen::Vector3i high = BlockOf(box.high);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) visit(Eigen::Vector3i(x, y, z));
      }
    }
  }

  // visit(bit, begin, end): the slots of each of these cells that has points.
  template <class Visit>
  void ForEachCell(const Block& block, std::uint64_t cells, Visit&& visit) const {
    for (std::uint64_t left = block.cells & cells; left != 0; left &= left - 1) {
      const std::uint64_t before = (left & -left) - 1;
      const int cell = block.first + std::popcount(block.cells & before);
      const auto at = static_cast<std::size_t>(cell);
      visit(std::countr_zero(left), begin_[at], begin_[at + 1]);
    }
  }

  float Reach(const Search& search) const;
  void ScanBlock(const Eigen::Vector3i& at, std::uint64_t cells, Search& search) const;
  void ScanSlots(int begin, int end, Search& search) const;
  void Consider(int slot, float squared, Search& search) const;

  float cells_per_m_;
  VoxelHash block_ids_;  // block -> position in blocks_
  std::vector<Block> blocks_;
  std::vector<int> begin_;        // [cells + 1], first slot of each cell
  std::vector<int> order_;        // [N], slot -> original index
  std::vector<float> x_, y_, z_;  // by slot, and room to read a few beyond the last
};

}  // namespace covsplat
