// Distances from points to the nearest point of a cloud.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/parallel.hpp"

namespace covsplat {

/// A k-d tree over points, which must outlive it and be finite. Const members may be called from
/// any thread.
class NearestPoints {
 public:
  explicit NearestPoints(std::span<const Eigen::Vector3d> points);
  ~NearestPoints();
  NearestPoints(NearestPoints&&) noexcept;
  NearestPoints& operator=(NearestPoints&&) noexcept;

  /// Metres; infinity if there are no points.
  double DistanceFrom(const Eigen::Vector3d& point) const;
  std::vector<float> DistancesFrom(std::span<const Eigen::Vector3d> points, ThreadPool& pool) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace covsplat
