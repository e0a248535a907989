#include "covsplat/registration/degeneracy.hpp"

#include "covsplat/registration/symmetric_eigen.hpp"

namespace covsplat {
namespace {

std::vector<Eigen::Vector3d> WeakEigenvectors(const Eigen::Matrix3d& information,
                                              const Eigen::Matrix3d& enough) {
  const SymmetricEigen eigen = DecomposeSymmetric(information);
  std::vector<Eigen::Vector3d> weak;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d direction = eigen.vectors.col(k);
    if (!(eigen.values[k] > direction.dot(enough * direction))) weak.push_back(direction);
  }
  return weak;
}

// A - B C^-1 B^T; directions in which C holds nothing do not reduce A.
Eigen::Matrix3d SchurComplement(const Eigen::Matrix3d& a,
                                const Eigen::Matrix3d& b,
                                const Eigen::Matrix3d& c) {
  constexpr double kNothing = 1e-9;
  const SymmetricEigen eigen = DecomposeSymmetric(c);
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (eigen.values[k] > kNothing * eigen.values[0]) inverse[k] = 1.0 / eigen.values[k];
  }
  const Eigen::Matrix3d projected = b * eigen.vectors;
  return a - projected * inverse.asDiagonal() * projected.transpose();
}

Eigen::Matrix3d ProjectionWithout(const std::vector<Eigen::Vector3d>& directions) {
  Eigen::Matrix3d projection = Eigen::Matrix3d::Identity();
  for (const Eigen::Vector3d& d : directions) projection -= d * d.transpose();
  return projection;
}

}  // namespace

Matrix6d WithoutDirections(const Matrix6d& information, const WeakDirections& weak) {
  Matrix6d held = Matrix6d::Zero();
  held.topLeftCorner<3, 3>() = ProjectionWithout(weak.rotations);
  held.bottomRightCorner<3, 3>() = ProjectionWithout(weak.translations);
  return held * information * held;
}

WeakDirections FindWeakDirections(const Matrix6d& information,
                                  double mass,
                                  const Eigen::Matrix3d& inertia,
                                  double ratio) {
  const Eigen::Matrix3d rr = information.topLeftCorner<3, 3>();
  const Eigen::Matrix3d rt = information.topRightCorner<3, 3>();
  const Eigen::Matrix3d tt = information.bottomRightCorner<3, 3>();
  const Eigen::Matrix3d isotropic = mass * Eigen::Matrix3d::Identity();
  return {
      .rotations = WeakEigenvectors(SchurComplement(rr, rt, tt), ratio * inertia),
      .translations = WeakEigenvectors(SchurComplement(tt, rt.transpose(), rr), ratio * isotropic)};
}

}  // namespace covsplat
