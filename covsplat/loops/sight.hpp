// Sight: how far a scan saw, by coarse directions.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace covsplat {

/// What a scan says of a point.
enum class Seen {
  kUnknown,  ///< nothing returned from there, or it is hidden by what did
  kThere,    ///< the nearest return in its direction is about as far
  kThrough,  ///< all returns in its direction are farther: there is nothing
};

/// 16 KiB a scan, whatever the sensor. The nearest return of a direction stands for all, which errs
/// on the side of kUnknown.
class Sight {
 public:
  /// Nothing is known.
  Sight() = default;
  /// `points`: of the scan, sensor frame, m.
  explicit Sight(std::span<const Eigen::Vector3f> points);

  /// Of a point in the same frame.
  Seen See(const Eigen::Vector3f& point) const;

  std::size_t Bytes() const { return nearest_cm_.size() * sizeof(std::uint16_t); }

 private:
  std::vector<std::uint16_t> nearest_cm_;  ///< by direction; 0: nothing returned
};

}  // namespace covsplat
