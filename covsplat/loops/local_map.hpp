// Local maps: what a few keyframes saw, brought together to be recognised.
#pragma once

#include <vector>

#include "covsplat/loops/sight.hpp"
#include "covsplat/registration/preprocess.hpp"
#include "covsplat/registration/target.hpp"

namespace covsplat {

/// What is kept of a keyframe to know its place again, in the sensor frame.
struct Place {
  int keyframe = 0;
  std::vector<Eigen::Vector3f> points;   ///< [N] m
  std::vector<Eigen::Vector3f> normals;  ///< [N] unit; zero where it is not flat
  Sight sight;
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
