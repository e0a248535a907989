#include "covsplat/core/se3.hpp"

#include <cmath>

#include <Eigen/SVD>

namespace covsplat {
namespace {

// Coefficients of the SO(3) left Jacobian I + b*W + c*W^2 at the angle theta, W = Skew(omega).
// Below kSmallAngle their series are exact to double precision.
constexpr double kSmallAngle = 1e-4;

double JacobianB(double theta) {
  return theta < kSmallAngle ? 0.5 - theta * theta / 24.0
                             : (1.0 - std::cos(theta)) / (theta * theta);
}

double JacobianC(double theta) {
  return theta < kSmallAngle ? 1.0 / 6.0 - theta * theta / 120.0
                             : (theta - std::sin(theta)) / (theta * theta * theta);
}

Eigen::Vector3d LogSO3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // the short way round
  const double sin_half = q.vec().norm();
  const double angle = 2.0 * std::atan2(sin_half, sign * q.w());
  const double factor = sin_half < 1e-12 ? 2.0 : angle / sin_half;
  return sign * factor * q.vec();
}

Eigen::Quaterniond ExpSO3(const Eigen::Vector3d& omega) {
  const double theta = omega.norm();
  const double factor =
      theta < kSmallAngle ? 0.5 - theta * theta / 48.0 : std::sin(0.5 * theta) / theta;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * theta);
  q.vec() = factor * omega;
  return q;
}

}  // namespace

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

SE3 SE3::FromMatrix(const Eigen::Matrix4d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix.topLeftCorner<3, 3>(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0.0) {
    Eigen::Matrix3d flipped = svd.matrixU();
    flipped.col(2) *= -1.0;
    rotation = flipped * svd.matrixV().transpose();
  }
  return {Eigen::Quaterniond(rotation), matrix.topRightCorner<3, 1>()};
}

SE3 SE3::Exp(const Vector6d& xi) {
  const Eigen::Vector3d omega = xi.head<3>();
  const double theta = omega.norm();
  const Eigen::Matrix3d skew = Skew(omega);
  const Eigen::Matrix3d left_jacobian =
      Eigen::Matrix3d::Identity() + JacobianB(theta) * skew + JacobianC(theta) * skew * skew;
  return {ExpSO3(omega), left_jacobian * xi.tail<3>()};
}

Vector6d SE3::Log() const {
  const Eigen::Vector3d omega = LogSO3(rotation_);
  const double theta = omega.norm();
  const Eigen::Matrix3d skew = Skew(omega);
  const double half = 0.5 * theta;
  const double factor = theta < kSmallAngle
                            ? 1.0 / 12.0 + theta * theta / 720.0
                            : (1.0 - half * std::cos(half) / std::sin(half)) / (theta * theta);
  const Eigen::Matrix3d inverse_left_jacobian =
      Eigen::Matrix3d::Identity() - 0.5 * skew + factor * skew * skew;
  Vector6d xi;
  xi << omega, inverse_left_jacobian * translation_;
  return xi;
}

SE3 SE3::Inverse() const {
  const Eigen::Quaterniond inverse = rotation_.conjugate();
  return {inverse, -(inverse * translation_)};
}

Matrix6d SE3::Adjoint() const {
  const Eigen::Matrix3d rotation = RotationMatrix();
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = rotation;
  adjoint.bottomLeftCorner<3, 3>() = Skew(translation_) * rotation;
  adjoint.bottomRightCorner<3, 3>() = rotation;
  return adjoint;
}

Eigen::Matrix4d SE3::Matrix() const {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = RotationMatrix();
  matrix.topRightCorner<3, 1>() = translation_;
  return matrix;
}

Matrix6d AdjointOf(const Vector6d& xi) {
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = Skew(xi.head<3>());
  ad.bottomLeftCorner<3, 3>() = Skew(xi.tail<3>());
  ad.bottomRightCorner<3, 3>() = ad.topLeftCorner<3, 3>();
  return ad;
}

// The series of x / (1 - exp(-x)) = 1 + x/2 + x^2/12 - x^4/720 + ... at x = ad(xi), whose
// eigenvalues are 0 and twice i theta and -i theta: a polynomial of fourth degree that has the
// series' value and slope there is the whole series.
Matrix6d InverseRightJacobian(const Vector6d& xi) {
  constexpr double kSeriesBelow = 0.2;
  const double theta = xi.head<3>().norm();
  const double square = theta * theta;
  double quadratic = 1.0 / 12.0 - square * square / 30240.0 - square * square * square / 604800.0;
  double quartic = -1.0 / 720.0 - square / 15120.0 - square * square / 403200.0;
  if (theta >= kSeriesBelow) {
    const double half = 0.5 * theta;
    const double value = half * std::cos(half) / std::sin(half);
    const double slope_theta = value - square / (4.0 * std::sin(half) * std::sin(half));
    quartic = (slope_theta + 2.0 * (1.0 - value)) / (2.0 * square * square);
    quadratic = (1.0 - value) / square + quartic * square;
  }
  const Matrix6d ad = AdjointOf(xi);
  const Matrix6d ad_square = ad * ad;
  return Matrix6d::Identity() + 0.5 * ad + quadratic * ad_square + quartic * ad_square * ad_square;
}

SE3 Interpolate(const SE3& a, const SE3& b, double s) {
  return a * SE3::Exp(s * (a.Inverse() * b).Log());
}

}  // namespace covsplat
