// SE3: a rigid transform in double precision.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace covsplat {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Skew-symmetric matrix: `Skew(a) * b == a.cross(b)`.
Eigen::Matrix3d Skew(const Eigen::Vector3d& v);

/// T_a_b maps frame b to frame a: p_a = T_a_b * p_b. The rotation is a unit quaternion that every
/// product renormalises, so that long chains stay rigid.
/// Tangent vectors are [rotation (rad), translation (m)]; perturbations act on the right:
/// T * Exp(xi).
class SE3 {
 public:
  SE3() = default;
  SE3(const Eigen::Quaterniond& rotation, Eigen::Vector3d translation)
      : rotation_(rotation.normalized()), translation_(std::move(translation)) {}

  /// Nearest rigid transform to a 4x4 (or the upper 3x4 of a) matrix.
  static SE3 FromMatrix(const Eigen::Matrix4d& matrix);
  static SE3 Exp(const Vector6d& xi);
  Vector6d Log() const;

  SE3 Inverse() const;
  Matrix6d Adjoint() const;
  Eigen::Matrix4d Matrix() const;
  bool IsFinite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

  const Eigen::Quaterniond& Rotation() const { return rotation_; }
  const Eigen::Vector3d& Translation() const { return translation_; }
  Eigen::Matrix3d RotationMatrix() const { return rotation_.toRotationMatrix(); }

  SE3 operator*(const SE3& other) const {
    return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation_ * point + translation_;
  }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

/// Lie bracket matrix: ad(x) y = [x, y].
Matrix6d AdjointOf(const Vector6d& xi);

/// Inverse of the right Jacobian: (Exp(xi) * Exp(d)).Log() = xi + InverseRightJacobian(xi) * d for
/// small d.
Matrix6d InverseRightJacobian(const Vector6d& xi);

/// Geodesic from a (s = 0) to b (s = 1); s outside [0, 1] extrapolates.
SE3 Interpolate(const SE3& a, const SE3& b, double s);

}  // namespace covsplat
