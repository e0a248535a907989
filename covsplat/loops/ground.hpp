// Where the ground is in a local map.
#pragma once

#include <span>

#include <Eigen/Core>

#include "covsplat/core/se3.hpp"

namespace covsplat {

/// T_ground_local: turns points by roll and pitch and lifts them so that the ground around the
/// origin is at z = 0. The local z axis must point up to within some 20 degrees. As in MapClosures
/// (Gupta et al., ICRA 2024): the lowest points of all cells of 5 m are fitted by a plane.
SE3 AlignWithGround(std::span<const Eigen::Vector3f> points);

}  // namespace covsplat
