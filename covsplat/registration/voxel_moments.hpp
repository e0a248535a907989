// VoxelMoments: points of a scan summed up per voxel, the basis of downsampling and covariances.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/registration/symmetric_eigen.hpp"
#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {

/// A grid of voxels with the first two moments of the points in each. Neighbourhoods are merged
/// from voxels, so every measurement counts at the price of a few look-ups for each point, where a
/// k-nearest-neighbour search sees a handful of downsampled points and costs several times more.
class VoxelMoments {
 public:
  VoxelMoments(std::span<const Eigen::Vector3f> points, float voxel_m);

  std::size_t Size() const { return voxels_.size(); }
  /// The point nearest to the voxel's centre, the lower index among equals.
  int Representative(std::size_t voxel) const { return voxels_[voxel].representative; }

  /// Covariance [m^2], decomposed, of the surface around a voxel: of the (2 r + 1)^3 voxels around
  /// it, with the smallest r of at most `kMaxRadius` that has `min_points` measurements and spans a
  /// surface. Where that is not flat, voxels off the plane through the voxel itself fade out, so
  /// that walls meeting in a corner keep their own normals.
  SymmetricEigen SurfaceAround(std::size_t voxel, int min_points) const;

 private:
  using Packed = Eigen::Matrix<float, 6, 1>;  // xx xy xz yy yz zz
  struct Voxel {
    Eigen::Vector3i cell;
    int representative = -1;
    float squared_to_centre = 0.0f;
    float count = 0.0f;
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();  // relative to the voxel's centre
    Packed spread = Packed::Zero();                  // covariance about the mean
  };
  struct Plane;
  struct Neighbourhood;
  static constexpr int kMaxRadius = 3;

  void Add(Voxel& voxel, const Eigen::Vector3f& point, int index) const;
  Neighbourhood Gather(const Voxel& centre, int radius, const Plane* plane) const;

  float voxel_m_;
  VoxelHash cells_;  // cell -> position in voxels_
  std::vector<Voxel> voxels_;
};

}  // namespace covsplat
