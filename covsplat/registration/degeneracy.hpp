// Which directions of a pose a scan determines.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/se3.hpp"

namespace covsplat {

/// Unit directions without enough information, in the frame of the information matrix.
struct WeakDirections {
  std::vector<Eigen::Vector3d> rotations;
  std::vector<Eigen::Vector3d> translations;
};

/// What registration tells of a pose.
struct PoseKnowledge {
  /// Right perturbation [rad, m], in 1/rad^2 and 1/m^2; zero in directions that surfaces do not
  /// hold. Nothing if the pose was given.
  std::optional<Matrix6d> information;
  bool is_degenerate = false;  ///< whether there are such directions
};

/// Nothing is known any more in the weak directions.
Matrix6d WithoutDirections(const Matrix6d& information, const WeakDirections& weak);

/// Eigen-decomposes the information of the translation after the best rotation (the Schur
/// complement H_tt - H_tr H_rr^-1 H_rt) and that of the rotation after the best translation. A
/// direction is weak if it has less than `ratio` times the information that surfaces facing every
/// way would have given: of `mass` for translations, of `inertia` for rotations. So the measure
/// needs no units and a narrow corridor does not make the turn about its axis look weak.
/// `information` is of [rotation, translation].
WeakDirections FindWeakDirections(const Matrix6d& information,
                                  double mass,
                                  const Eigen::Matrix3d& inertia,
                                  double ratio);

}  // namespace covsplat
