// NearestIndex: exact nearest neighbours among fixed points, by hashed grid cells.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {

/// Points are stored cell by cell; a *slot* is a point's place in that order. Results do not depend
/// on the cell size: among equally near points the one with the lowest original index wins.
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
    for (int k = 0; k < 27; ++k) {
      const int cell = cells_.Find(home + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
      if (cell < 0) continue;
      const int end = begin_[static_cast<std::size_t>(cell) + 1];
      for (int slot = begin_[static_cast<std::size_t>(cell)]; slot < end; ++slot) {
        visit(static_cast<std::size_t>(IndexOf(slot)));
      }
    }
  }

 private:
  // The two nearest points so far.
  struct Search {
    Eigen::Vector3f query;
    int slot = -1;
    float squared;
    float second_squared = std::numeric_limits<float>::infinity();
  };
  void ScanCell(const Eigen::Vector3i& cell, Search& search) const;
  void Consider(int slot, float squared, Search& search) const;

  float cells_per_m_;
  VoxelHash cells_;               // cell -> position in begin_
  std::vector<int> begin_;        // [cells + 1], first slot of each cell
  std::vector<int> order_;        // [N], slot -> original index
  std::vector<float> x_, y_, z_;  // by slot, and room to read a few beyond the last
};

}  // namespace covsplat
