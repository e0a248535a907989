// RegistrationTarget: the surfels that scans are registered to.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "covsplat/registration/nearest_index.hpp"

namespace covsplat {

/// A flat piece of surface: position, orientation, extent.
struct TargetSurfel {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();  ///< map frame, relative to the target's origin
  /// R_map_surfel; its third axis is the normal. Need not be normalised.
  Eigen::Quaternionf rotation = Eigen::Quaternionf::Identity();
  float scale0 = 1.0f;  ///< standard deviation along the first axis, m
  float scale1 = 1.0f;  ///< along the second; the order of the two does not matter
  float weight = 1.0f;  ///< of matches; only the ratio to that of others matters
};

/// Immutable once built, so one target may serve several threads. Positions are float relative to
/// `origin_map`, which keeps maps of kilometres precise. Surfels with values that are not finite or
/// with a zero rotation are left out.
class RegistrationTarget {
 public:
  /// What matching needs to know of a surfel; one cache line.
  struct alignas(64) Record {
    Eigen::Vector3f mean;
    Eigen::Vector3f normal;
    Eigen::Matrix<float, 6, 1> covariance;  ///< xx xy xz yy yz zz, middle eigenvalue 1
    float weight;
  };

  RegistrationTarget() : RegistrationTarget({}, Eigen::Vector3d::Zero(), 0) {}
  RegistrationTarget(std::span<const TargetSurfel> surfels,
                     const Eigen::Vector3d& origin_map,
                     int keyframes,
                     double cell_m = 1.0);

  std::size_t Size() const { return records_.size(); }
  const Eigen::Vector3d& OriginMap() const { return origin_map_; }
  /// So many keyframes the map had when the target was made of it.
  int Keyframes() const { return keyframes_; }
  const NearestIndex& Index() const { return index_; }
  /// Record in a slot of the index.
  const Record& At(int slot) const { return records_[static_cast<std::size_t>(slot)]; }
  /// Position of a slot's surfel in the span the target was built from.
  int SurfelOf(int slot) const { return surfel_[static_cast<std::size_t>(slot)]; }

 private:
  RegistrationTarget(std::span<const TargetSurfel> surfels,
                     std::vector<int> usable,
                     const Eigen::Vector3d& origin_map,
                     int keyframes,
                     double cell_m);

  Eigen::Vector3d origin_map_;
  int keyframes_;
  NearestIndex index_;
  std::vector<int> surfel_;      // by slot
  std::vector<Record> records_;  // by slot
};

/// Covariance of a surface for matching: `axes diag(lambda0, 1, eps) axes^T` with
/// `lambda0 = clip((sigma0 / sigma1)^2, 1, 100)`; source and target share it. Packed as
/// xx xy xz yy yz zz. `sigma0 >= sigma1`.
Eigen::Matrix<float, 6, 1> SurfaceCovariance(const Eigen::Matrix3f& axes,
                                             float sigma0,
                                             float sigma1);

}  // namespace covsplat
