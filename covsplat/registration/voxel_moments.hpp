// VoxelMoments: points of a scan summed up per voxel, the basis of downsampling and covariances.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/registration/symmetric_eigen.hpp"
#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {

/// A grid of voxels with the first two moments of the points in each. Neighbourhoods are merged
/// from voxels, so every measurement counts at the price of a few look-ups for each point, where a
/// k-nearest-neighbour search sees a handful of downsampled points and costs several times more.
/// Voxels upon each other lie side by side in memory: one look-up finds a whole column of them.
class VoxelMoments {
 public:
  /// The points' fourth coordinates are not used: vectors of four are what processors are fast at.
  VoxelMoments(std::span<const Eigen::Vector4f> points, float voxel_m);

  std::size_t Size() const { return voxels_.size(); }
  /// The point nearest to the centre of a voxel, the lower index among equals. Voxels are numbered
  /// in the order of the first point in each.
  int Representative(std::size_t voxel) const { return At(voxel).representative; }

  /// Covariance [m^2], decomposed, of the surface around a voxel: of the (2 r + 1)^3 voxels around
  /// it, with the smallest r of at most `kMaxRadius` that has `min_points` measurements and spans a
  /// surface. Where that is not flat, voxels off the plane through the voxel itself fade out, so
  /// that walls meeting in a corner keep their own normals.
  SymmetricEigen SurfaceAround(std::size_t voxel, int min_points) const;

 private:
  /// One cache line. Moments are those of its points from its centre, in m and m^2.
  struct alignas(64) Voxel {
    Eigen::Vector3i cell;
    int representative = 0;
    std::array<float, 4> mean = {};    ///< x y z x
    std::array<float, 4> square = {};  ///< variances xx yy zz; then the number of points
    std::array<float, 4> mixed = {};   ///< covariances xy yz zx

    float Count() const { return square[3]; }
  };
  struct Plane;
  class Neighbourhood;
  static constexpr int kMaxRadius = 3;

  const Voxel& At(std::size_t voxel) const { return voxels_[place_[voxel]]; }
  void Collect(std::span<const Eigen::Vector4f> points);
  void SortIntoColumns();
  template <class Visit>
  void ForEachAround(const Voxel& centre, int hole, int radius, Visit&& visit) const;
  SymmetricEigen AlongPlane(const Voxel& centre, int radius, Eigen::Vector3f normal) const;

  float voxel_m_;
  std::vector<Voxel> voxels_;                // column by column, upwards
  std::vector<std::uint32_t> place_;         // [voxels] where in voxels_
  VoxelHash columns_;                        // (x, y, 0) -> position in column_begin_
  std::vector<std::uint32_t> column_begin_;  // [columns + 1]
};

}  // namespace covsplat
