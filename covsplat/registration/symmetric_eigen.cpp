#include "covsplat/registration/symmetric_eigen.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

namespace covsplat {
namespace {

// Zeroes a(p, q) by a rotation in the plane of p and q; r is the third axis.
void Rotate(Eigen::Matrix3d& a, Eigen::Matrix3d& v, int p, int q) {
  const int r = 3 - p - q;
  const double theta = (a(q, q) - a(p, p)) / (2.0 * a(p, q));
  const double t = std::copysign(1.0 / (std::abs(theta) + std::sqrt(theta * theta + 1.0)), theta);
  const double c = 1.0 / std::sqrt(t * t + 1.0);
  const double s = t * c;
  a(p, p) -= t * a(p, q);
  a(q, q) += t * a(p, q);
  a(p, q) = a(q, p) = 0.0;
  const double rp = a(r, p);
  const double rq = a(r, q);
  a(r, p) = a(p, r) = c * rp - s * rq;
  a(r, q) = a(q, r) = s * rp + c * rq;
  const Eigen::Vector3d vp = v.col(p);
  v.col(p) = c * vp - s * v.col(q);
  v.col(q) = s * vp + c * v.col(q);
}

}  // namespace

SymmetricEigen DecomposeSymmetric(const Eigen::Matrix3d& matrix) {
  constexpr int kMaxSweeps = 12;  // converges quadratically: 4 to 6 are usual
  Eigen::Matrix3d a = matrix.selfadjointView<Eigen::Lower>();
  Eigen::Matrix3d v = Eigen::Matrix3d::Identity();
  const double negligible = std::numeric_limits<double>::epsilon() * a.cwiseAbs().maxCoeff();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    bool done = true;
    for (const auto& [p, q] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
      if (!(std::abs(a(p, q)) > negligible)) continue;
      Rotate(a, v, p, q);
      done = false;
    }
    if (done) break;
  }
  int order[3] = {0, 1, 2};
  if (a(order[0], order[0]) < a(order[1], order[1])) std::swap(order[0], order[1]);
  if (a(order[1], order[1]) < a(order[2], order[2])) std::swap(order[1], order[2]);
  if (a(order[0], order[0]) < a(order[1], order[1])) std::swap(order[0], order[1]);
  SymmetricEigen result;
  for (int k = 0; k < 3; ++k) result.values[k] = a(order[k], order[k]);
  result.vectors.col(0) = v.col(order[0]).normalized();
  result.vectors.col(1) = v.col(order[1]).normalized();
  result.vectors.col(2) = result.vectors.col(0).cross(result.vectors.col(1));
  return result;
}

}  // namespace covsplat
