#include "covsplat/registration/symmetric_eigen.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace covsplat {
namespace {

struct Extremes {
  double largest, smallest;
};

/// Eigenvalues of a matrix with trace 0 by the trigonometric solution of its characteristic
/// polynomial x^3 - 3 p^2 x - det (Smith, Communications of the ACM 4(4), 1961).
Extremes ExtremesOf(const Eigen::Matrix3d& deviator) {
  constexpr double kThirdOfTurn = 2.0 * std::numbers::pi / 3.0;
  const double p = std::sqrt(deviator.squaredNorm() / 6.0);
  const double cosine = 0.5 * deviator.determinant() / (p * p * p);
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0)) / 3.0;
  return {2.0 * p * std::cos(angle), 2.0 * p * std::cos(angle + kThirdOfTurn)};
}

/// Unit vector that a matrix of rank 2 takes to zero: at a right angle to all its rows.
Eigen::Vector3d Kernel(const Eigen::Matrix3d& m) {
  const Eigen::Vector3d a = m.row(0).cross(m.row(1));
  const Eigen::Vector3d b = m.row(0).cross(m.row(2));
  const Eigen::Vector3d c = m.row(1).cross(m.row(2));
  const double aa = a.squaredNorm();
  const double bb = b.squaredNorm();
  const double cc = c.squaredNorm();
  if (aa >= bb && aa >= cc) return a / std::sqrt(aa);
  return bb >= cc ? b / std::sqrt(bb) : c / std::sqrt(cc);
}

struct Pair2 {
  double larger, smaller;
  Eigen::Vector3d along;  ///< eigenvector of the larger one
};

/// Eigenvalues and vectors in the plane at a right angle to a unit vector: one Jacobi rotation.
Pair2 DecomposeWithin(const Eigen::Matrix3d& m, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  const Eigen::Vector3d mu = m * u;
  const double uu = u.dot(mu);
  const double uv = v.dot(mu);
  const double vv = v.dot(m * v);
  const double half = 0.5 * (uu - vv);
  const double radius = std::sqrt(half * half + uv * uv);
  const double middle = 0.5 * (uu + vv);
  // (radius + half, uv) and (uv, radius - half) both lie along it: the longer is more precise.
  const Eigen::Vector3d along =
      half >= 0.0 ? ((radius + half) * u + uv * v).eval() : (uv * u + (radius - half) * v).eval();
  const double length = along.norm();
  return {middle + radius, middle - radius, length > 0.0 ? (along / length).eval() : u};
}

}  // namespace

SymmetricEigen DecomposeSymmetric(const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d m = matrix.selfadjointView<Eigen::Lower>();
  const double scale = m.cwiseAbs().maxCoeff();
  if (!(scale > 0.0)) return {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  const Eigen::Matrix3d unit = m / scale;
  const double mean = unit.trace() / 3.0;
  const Eigen::Matrix3d deviator = unit - mean * Eigen::Matrix3d::Identity();
  if (!(deviator.cwiseAbs().maxCoeff() > 1e-15)) {
    return {Eigen::Vector3d::Constant(scale * mean), Eigen::Matrix3d::Identity()};
  }
  const Extremes extremes = ExtremesOf(deviator);
  // The one that is farther from the other two has the better conditioned vector.
  const bool largest_first = extremes.largest + extremes.smallest >= 0.0;
  const double alone = largest_first ? extremes.largest : extremes.smallest;
  const Eigen::Vector3d vector = Kernel(deviator - alone * Eigen::Matrix3d::Identity());
  const Pair2 others = DecomposeWithin(unit, vector);
  SymmetricEigen result;
  const double value = vector.dot(unit * vector);
  if (largest_first) {
    result.values << value, others.larger, others.smaller;
    result.vectors.col(0) = vector;
    result.vectors.col(1) = others.along;
  } else {
    result.values << others.larger, others.smaller, value;
    result.vectors.col(0) = others.along;
    result.vectors.col(1) = vector.cross(others.along);
  }
  result.vectors.col(2) = result.vectors.col(0).cross(result.vectors.col(1));
  result.values *= scale;
  return result;
}

}  // namespace covsplat
