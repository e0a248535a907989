// PointGrid: the measurements of several scans, sorted into the cells of an octree.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {

/// Measurements of one scan, in the sensor's frame at its pose.
struct PosedPoints {
  SE3 T_map_sensor;
  std::span<const Eigen::Vector3f> points;  ///< m
  std::span<const float> intensity = {};    ///< of each, or empty
};

/// Sums over measurements, their positions relative to a corner.
struct Moments {
  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d square = Eigen::Vector3d::Zero();     ///< xx, yy, zz
  Eigen::Vector3d mixed = Eigen::Vector3d::Zero();      ///< xy, yz, zx
  Eigen::Vector3d to_sensor = Eigen::Vector3d::Zero();  ///< from the point to who measured it
  double intensity = 0.0;

  void Add(const Eigen::Vector3d& point, const Eigen::Vector3d& sensor, double its_intensity);
  void Add(const Moments& other);
  Eigen::Vector3d Mean() const { return sum / count; }
  Eigen::Matrix3d Covariance() const;
};

/// A finest cell that holds measurements. The three highest bits of its code number the eighth of
/// the block that it lies in, the next three the eighth of that, and so on.
struct PointCell {
  int code = 0;
  Moments moments;  ///< relative to the corner of the block
};

/// Two levels: blocks in a hash table, and in each the finest cells by their codes. Aligned with
/// the map, so that the cells of one keyframe are those of the next; its origin is near the last
/// scan, so that floats do.
class PointGrid {
 public:
  /// Where something is: a block and the code of a finest cell in it.
  struct Place {
    std::size_t block = 0;
    int code = 0;
  };

  /// Points that are not finite or out of the sensor's range are left out. `levels`: how often a
  /// block is halved.
  PointGrid(std::span<const PosedPoints> scans,
            const SensorModel& sensor,
            double block_m,
            int levels,
            ThreadPool& pool);

  const SE3& FromMap() const { return T_grid_map_; }
  int Levels() const { return levels_; }
  double CellSize(int level) const { return block_m_ / (1 << level); }
  int CellsPerBlock() const { return 1 << 3 * levels_; }

  std::size_t Blocks() const { return cells_.size(); }
  std::span<const PointCell> Cells(std::size_t block) const { return cells_[block]; }
  Eigen::Vector3d Corner(std::size_t block) const {
    return block_m_ * index_of_[block].cast<double>();
  }

  /// Of a finest cell.
  Eigen::Vector3d MiddleOf(std::size_t block, int code) const;

  /// Nothing where no block holds measurements. The position has to be finite.
  std::optional<Place> Find(const Eigen::Vector3f& p_grid) const;

  /// Calls f(block) for each one with measurements that a box reaches into.
  template <class F>
  void ForBlocksIn(const Eigen::AlignedBox3f& box_grid, F&& f) const;

 private:
  struct Point;
  struct Located;
  struct Sorted;
  Located Locate(std::span<const PosedPoints> scans,
                 const SensorModel& sensor,
                 ThreadPool& pool) const;
  Sorted SortIntoBlocks(Located located);
  /// Number of a block; none for new ones once there are too many.
  int FindOrAddBlock(const Eigen::Vector3i& index);
  /// Coordinates of finest cells, of the block that holds one, and its code there.
  Eigen::Vector3i FinestCellOf(const Eigen::Vector3f& p_grid) const {
    return CellOf(finest_per_m_ * p_grid);
  }
  Eigen::Vector3i BlockOf(const Eigen::Vector3i& finest_cell) const;
  int CodeOf(const Eigen::Vector3i& finest_cell) const;
  /// `slot_of`: [code] all -1, before and after.
  std::vector<PointCell> CellsOf(const Sorted& sorted,
                                 std::size_t block,
                                 std::span<int> slot_of) const;

  SE3 T_grid_map_;
  double block_m_;
  int levels_;
  float finest_per_m_;
  VoxelHash block_at_;
  std::vector<Eigen::Vector3i> index_of_;      ///< [B]
  std::vector<std::vector<PointCell>> cells_;  ///< [B] by code
};

template <class F>
void PointGrid::ForBlocksIn(const Eigen::AlignedBox3f& box_grid, F&& f) const {
  const Eigen::Vector3i first = BlockOf(FinestCellOf(box_grid.min()));
  const Eigen::Vector3i last = BlockOf(FinestCellOf(box_grid.max()));
  for (int x = first.x(); x <= last.x(); ++x) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int z = first.z(); z <= last.z(); ++z) {
        const int block = block_at_.Find({x, y, z});
        if (block >= 0) f(static_cast<std::size_t>(block));
      }
    }
  }
}

}  // namespace covsplat
