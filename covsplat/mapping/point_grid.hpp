// PointGrid: the measurements of several scans, sorted into the cells of an octree.
#pragma once

#include <cstdint>
#include <limits>
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

  /// Nothing where no block holds measurements. The position has to be finite.
  std::optional<Place> Find(const Eigen::Vector3f& p_grid) const;

  /// Whether any block that a box reaches into holds measurements.
  bool HoldsAnyIn(const Eigen::AlignedBox3f& box_grid) const;

  /// Whether everything within a margin of a position, axis by axis, is in the same finest cell.
  bool IsWithinCell(const Eigen::Vector3f& p_grid, const Eigen::Vector3f& margin_m) const;

  /// Finds one position after the other; cheap where they are mostly in the same block.
  class Finder;

 private:
  struct Sorted;
  Sorted SortIntoBlocks(std::span<const PosedPoints> scans, const SensorModel& sensor);
  /// Coordinates of finest cells, of the block that holds one, and its code there.
  Eigen::Vector3i FinestCellOf(const Eigen::Vector3f& p_grid) const {
    return CellOf(finest_per_m_ * p_grid);
  }
  Eigen::Vector3i BlockOf(const Eigen::Vector3i& finest_cell) const;
  int CodeOf(const Eigen::Vector3i& finest_cell) const;
  std::vector<PointCell> CellsOf(const Sorted& sorted, std::size_t block) const;

  SE3 T_grid_map_;
  double block_m_;
  int levels_;
  float finest_per_m_;
  VoxelHash block_at_;
  std::vector<Eigen::Vector3i> index_of_;      ///< [B]
  std::vector<std::vector<PointCell>> cells_;  ///< [B] by code
};

class PointGrid::Finder {
 public:
  explicit Finder(const PointGrid& grid) : grid_(grid) {}

  /// As the grid's Find, but says nothing about a position in the same finest cell as the one
  /// before.
  std::optional<Place> FindNew(const Eigen::Vector3f& p_grid) {
    const Eigen::Vector3i finest_cell = grid_.FinestCellOf(p_grid);
    return finest_cell == finest_cell_ ? std::nullopt : Enter(finest_cell);
  }

 private:
  std::optional<Place> Enter(const Eigen::Vector3i& finest_cell);

  const PointGrid& grid_;
  Eigen::Vector3i finest_cell_ = Eigen::Vector3i::Constant(std::numeric_limits<int>::max());
  Eigen::Vector3i block_index_ = Eigen::Vector3i::Constant(std::numeric_limits<int>::max());
  int block_ = -1;
};

}  // namespace covsplat
