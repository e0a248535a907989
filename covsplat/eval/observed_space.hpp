// What a sensor saw of a world from its true poses: the ground-truth visibility that decides which
// surfaces a map is judged on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/eval/voxel_index.hpp"

namespace covsplat {

struct ObservedSpaceOptions {
  double near_m = 0.1;     ///< a surface is visible this near to a return
  double space_m = 0.5;    ///< edge of the cells of space that rays pass through
  double max_gap_s = 0.5;  ///< true poses are interpolated over gaps up to this
};

/// Two sets of cells, filled scan by scan; neither depends on the order of the scans.
///  - A point is visible if the centre of a cell that holds a return lies within `near_m`; these
///    cells have an edge of near_m / 2.
///  - A point is in observed space if its cell, or one of the 26 around it, was passed by a ray or
///    holds a return. One ray is followed per scan and cell of returns, from the sensor's place at
///    the scan's stamp.
class ObservedSpace {
 public:
  explicit ObservedSpace(const ObservedSpaceOptions& options);

  /// Each point is moved by the true pose at its own time, or at the scan's stamp if it has none.
  /// Returns how many had such a pose; points at the sensor itself and beyond the grid do not
  /// count.
  std::size_t Add(const Scan& scan, const Trajectory& truth);

  std::vector<std::uint8_t> Visible(std::span<const Eigen::Vector3d> points,
                                    ThreadPool& pool) const;
  std::vector<std::uint8_t> InObservedSpace(std::span<const Eigen::Vector3d> points,
                                            ThreadPool& pool) const;

 private:
  void AddRay(const Eigen::Vector3d& origin, std::uint64_t end);

  ObservedSpaceOptions options_;
  VoxelGrid return_grid_;
  VoxelGrid space_grid_;
  VoxelIndex returns_;
  VoxelIndex space_;
};

}  // namespace covsplat
