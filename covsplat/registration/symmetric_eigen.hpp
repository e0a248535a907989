// Eigen-decomposition of symmetric 3x3 matrices, sorted and always a proper rotation.
#pragma once

#include <Eigen/Core>

namespace covsplat {

struct SymmetricEigen {
  Eigen::Vector3d values;   ///< descending
  Eigen::Matrix3d vectors;  ///< columns, determinant +1
};

/// In closed form: the eigenvalue that is farthest from the others by trigonometry, its vector,
/// then one rotation at a right angle to it. Exact to rounding of the largest value, for repeated
/// and vanishing eigenvalues too. The third vector is the cross product of the first two, so the
/// columns never form a reflection. Reads the lower triangle.
SymmetricEigen DecomposeSymmetric(const Eigen::Matrix3d& matrix);

}  // namespace covsplat
