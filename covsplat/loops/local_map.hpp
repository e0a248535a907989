// Local maps: what a few keyframes saw, brought together to be recognised.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/loops/sight.hpp"
#include "covsplat/registration/preprocess.hpp"
#include "covsplat/registration/target.hpp"

namespace covsplat {

/// A surface point in ten bytes: maps of long ways have many.
class PlacePoint {
 public:
  static constexpr float kStepM = 0.005f;
  static constexpr float kFarthestM = 32767.0f * kStepM;

  /// No coordinate farther than `kFarthestM`.
  PlacePoint(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal);

  Eigen::Vector3f Position() const { return kStepM * position_.cast<float>(); }
  /// Unit; zero where it is not flat.
  Eigen::Vector3f Normal() const { return normal_.cast<float>().normalized(); }
  bool IsFlat() const { return !normal_.isZero(); }

 private:
  Eigen::Matrix<std::int16_t, 3, 1> position_;  ///< in steps
  Eigen::Matrix<std::int8_t, 3, 1> normal_;     ///< in steps of 1/127
};

/// What is kept of a keyframe to know its place again, in the sensor frame.
struct Place {
  int keyframe = 0;
  std::vector<PlacePoint> points;
  Sight sight;

  bool IsEmpty() const { return points.empty() && sight.Bytes() == 0; }
  std::size_t Bytes() const { return points.capacity() * sizeof(PlacePoint) + sight.Bytes(); }
};

/// Keeps the first surface point of each cube of `voxel_m`. `points`: the whole scan.
Place MakePlace(int keyframe,
                std::span<const Eigen::Vector3f> points,
                std::span<const Eigen::Vector3f> surface,
                std::span<const PointCovariance> covariance,
                double voxel_m);

/// A place as part of a local map, in that map's frame.
struct PosedPlace {
  const Place* place = nullptr;
  SE3 T_local_place;
};
using LocalMap = std::vector<PosedPlace>;

/// One point per cube of `voxel_m` of all places.
std::vector<Eigen::Vector3f> PointsOf(const LocalMap& map, double voxel_m);

/// The same of what is flat, as if one scan had measured it from the local map's origin.
SourceCloud SourceOf(const LocalMap& map, double voxel_m);

/// Surfels at one flat point per cube of `voxel_m`.
RegistrationTarget TargetOf(const LocalMap& map, double voxel_m);

/// Of the points that the places of `by` could see where they would lie, the share at which these
/// saw through: where there is nothing. 0 if they could see none.
double SeenThroughShare(const LocalMap& map, const LocalMap& by, const SE3& T_by_map);

}  // namespace covsplat
