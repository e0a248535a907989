#include "covsplat/registration/scan_residuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kGrain = 512;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Cosine of the angle between the normals of the two sides of a wall, and less.
constexpr float kOpposite = -0.9f;

using Packed3 = Eigen::Matrix<float, 6, 1>;  // xx xy xz yy yz zz

Eigen::Matrix3f Unpack(const Packed3& v) {
  Eigen::Matrix3f m;
  m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
  return m;
}

// Inverse of a symmetric positive definite matrix by cofactors.
Eigen::Matrix3f InvertSymmetric(const Eigen::Matrix3f& c) {
  const float xx = c(1, 1) * c(2, 2) - c(1, 2) * c(1, 2);
  const float xy = c(0, 2) * c(1, 2) - c(0, 1) * c(2, 2);
  const float xz = c(0, 1) * c(1, 2) - c(0, 2) * c(1, 1);
  const float yy = c(0, 0) * c(2, 2) - c(0, 2) * c(0, 2);
  const float yz = c(0, 1) * c(0, 2) - c(0, 0) * c(1, 2);
  const float zz = c(0, 0) * c(1, 1) - c(0, 1) * c(0, 1);
  const float inverse = 1.0f / (c(0, 0) * xx + c(0, 1) * xy + c(0, 2) * xz);
  Packed3 packed;
  packed << xx, xy, xz, yy, yz, zz;
  return Unpack(packed * inverse);
}

// J^T M J (upper triangle by rows) and J^T M e for e = mean - (lever + omega x lever + v).
Eigen::Matrix<float, 27, 1> PackTerms(const Eigen::Vector3f& lever,
                                      const Eigen::Matrix3f& m,
                                      const Eigen::Vector3f& m_e) {
  // With G = Skew(lever), J = [G, -I]: J^T M J = [G^T M G, -G^T M; ., M].
  Eigen::Matrix3f gm;  // -G^T M = Skew(lever) M
  for (int k = 0; k < 3; ++k) gm.col(k) = lever.cross(m.col(k));
  Eigen::Matrix3f gmg;  // G^T M G: rows of Skew(lever) M crossed with the lever
  for (int k = 0; k < 3; ++k) gmg.row(k) = lever.cross(gm.row(k).transpose()).transpose();
  const Eigen::Vector3f torque = -lever.cross(m_e);
  Eigen::Matrix<float, 27, 1> v;
  v << gmg(0, 0), gmg(0, 1), gmg(0, 2), gm(0, 0), gm(0, 1), gm(0, 2),  //
      gmg(1, 1), gmg(1, 2), gm(1, 0), gm(1, 1), gm(1, 2),              //
      gmg(2, 2), gm(2, 0), gm(2, 1), gm(2, 2),                         //
      m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2),            //
      torque, -m_e;
  return v;
}

Eigen::Matrix<float, 10, 1> LeverTerms(const Eigen::Vector3f& lever) {
  Eigen::Matrix<float, 10, 1> v;
  v << 1.0f, lever, lever.x() * lever, lever.y() * lever.tail<2>(), lever.z() * lever.z();
  return v;
}

}  // namespace

PhaseMoments& PhaseMoments::operator+=(const PhaseMoments& other) {
  for (std::size_t k = 0; k < kMoments; ++k) moment[k] += other.moment[k];
  lever += other.lever;
  weighted_square += other.weighted_square;
  kernel_sum += other.kernel_sum;
  kernel_square_sum += other.kernel_square_sum;
  plane_square += other.plane_square;
  matches += other.matches;
  inliers += other.inliers;
  return *this;
}

Matrix6d PhaseMoments::Matrix(int k) const {
  Matrix6d m;
  int at = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      m(row, column) = m(column, row) = moment[static_cast<std::size_t>(k)][at++];
    }
  }
  return m;
}

Vector6d PhaseMoments::Vector(int k) const { return moment[static_cast<std::size_t>(k)].tail<6>(); }

Eigen::Matrix3d PhaseMoments::Inertia() const {
  if (lever[0] <= 0.0) return Eigen::Matrix3d::Zero();
  const Eigen::Vector3d mean = lever.segment<3>(1) / lever[0];
  Eigen::Matrix3d second;
  second << lever[4], lever[5], lever[6], lever[5], lever[7], lever[8], lever[6], lever[8],
      lever[9];
  second -= lever[0] * mean * mean.transpose();
  return second.trace() * Eigen::Matrix3d::Identity() - second;
}

NormalEquations Assemble(const PhaseMoments& moments, const ScanMotion& motion) {
  Matrix6d to_sensor = Matrix6d::Zero();
  to_sensor.topLeftCorner<3, 3>() = motion.T_map_sensor.RotationMatrix().transpose();
  to_sensor.bottomRightCorner<3, 3>() = to_sensor.topLeftCorner<3, 3>();
  std::array<Matrix6d, PhaseMoments::kMoments> a;
  std::array<Vector6d, PhaseMoments::kMoments> b;
  for (int k = 0; k < PhaseMoments::kMoments; ++k) {
    a[static_cast<std::size_t>(k)] = to_sensor * moments.Matrix(k) * to_sensor.transpose();
    b[static_cast<std::size_t>(k)] = to_sensor * moments.Vector(k);
  }
  // The pose at s is T Exp(d) Exp(x + s e + s^2/2 f) with x = s twist + s^2/2 acceleration, and
  // Exp(x + y) = Exp(Jl(x) y) Exp(x) with Jl(x) = I + ad(x)/2 + ...
  const Matrix6d half_twist = 0.5 * AdjointOf(motion.twist).transpose();
  const Matrix6d quarter_acceleration = 0.25 * AdjointOf(motion.acceleration).transpose();
  NormalEquations equations;
  equations.gradient << b[0],  //
      b[1] + half_twist * b[2] + quarter_acceleration * b[3],
      0.5 * (b[2] + half_twist * b[3] + quarter_acceleration * b[4]);
  equations.hessian << a[0], a[1], 0.5 * a[2],  //
      a[1], a[2], 0.5 * a[3],                   //
      0.5 * a[2], 0.5 * a[3], 0.25 * a[4];
  return equations;
}

/// What a chunk needs to know of the motion.
struct ScanResiduals::Frame {
  PoseTable poses;         ///< R_map_s and the lever's offset, axes of the map about the sensor
  Eigen::Vector3f sensor;  ///< position at mid scan relative to the target's origin
  float inverse_kernel_scale;
  std::size_t stride;
};

ScanResiduals::ScanResiduals(const SourceCloud& source,
                             const RegistrationTarget& target,
                             double gate_m,
                             double inlier_distance_m,
                             bool same_side,
                             ThreadPool& pool)
    : source_(source),
      target_(target),
      squared_gate_(static_cast<float>(gate_m * gate_m)),
      inlier_distance_m_(static_cast<float>(inlier_distance_m)),
      same_side_(same_side),
      covariance_(source.Size()),
      slot_(source.Size(), -1),
      squared_distance_(source.Size(), kInfinity),
      searched_(source.Size(), Eigen::Vector3f::Constant(kInfinity)),
      clearance_m_(source.Size(), 0.0f),
      mahalanobis_(source.Size(), kInfinity) {
  COVSPLAT_CHECK(source.phase.size() == source.Size());
  COVSPLAT_CHECK(source.covariance.size() == source.Size());
  ParallelFor(pool, source.Size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const PointCovariance& c = source.covariance[i];
      covariance_[i] = SurfaceCovariance(c.axes, c.sigma_m[0], c.sigma_m[1]);
    }
  });
}

PhaseMoments ScanResiduals::Evaluate(const ScanMotion& motion,
                                     double kernel_scale,
                                     std::size_t stride,
                                     ThreadPool& pool) {
  const SE3& pose = motion.T_map_sensor;
  const Frame frame{PoseTable(motion, pose.RotationMatrix()),
                    (pose.Translation() - target_.OriginMap()).cast<float>(),
                    static_cast<float>(1.0 / kernel_scale),
                    stride};
  return ParallelSum(
      pool,
      (source_.Size() + stride - 1) / stride,
      kGrain,
      PhaseMoments(),
      [&](std::size_t begin, std::size_t end) { return SumChunk(frame, begin, end); });
}

// Steps become small soon, and most points then need no search: their match has clearance.
void ScanResiduals::Match(std::size_t i, const Eigen::Vector3f& position) {
  constexpr float kMargin = 0.1f;     // m
  constexpr float kRounding = 1e-4f;  // m
  constexpr float kFringe = 0.02f;    // m, by which the gate may be missed
  const float moved = (position - searched_[i]).norm();
  if (slot_[i] < 0 && moved < kFringe) return;
  if (slot_[i] >= 0) {
    const float squared = (target_.At(slot_[i]).mean - position).squaredNorm();
    if (squared < squared_gate_ && std::sqrt(squared) + moved + kRounding < clearance_m_[i]) {
      squared_distance_[i] = squared;
      return;
    }
  }
  const auto nearest = target_.Index().Nearest(position, squared_gate_, slot_[i], kMargin);
  slot_[i] = nearest.slot;
  squared_distance_[i] = nearest.squared_distance;
  searched_[i] = position;
  clearance_m_[i] = nearest.clearance_m;
}

PhaseMoments ScanResiduals::SumChunk(const Frame& frame, std::size_t begin, std::size_t end) {
  PhaseMoments sums;
  for (std::size_t k = begin; k < end; ++k) {
    const std::size_t i = k * frame.stride;
    const PoseTable::Pose pose = frame.poses.At(source_.phase[i]);
    const Eigen::Vector3f lever = pose.rotation * source_.points[i] + pose.translation;
    const Eigen::Vector3f position = lever + frame.sensor;
    Match(i, position);
    if (slot_[i] < 0) {
      mahalanobis_[i] = kInfinity;
      continue;
    }
    const RegistrationTarget::Record& surfel = target_.At(slot_[i]);
    if (same_side_) {
      const Eigen::Vector3f normal = pose.rotation * source_.covariance[i].axes.col(2);
      if (normal.dot(surfel.normal) <= kOpposite) {
        mahalanobis_[i] = kInfinity;
        continue;
      }
    }
    const Eigen::Vector3f e = surfel.mean - position;
    const Eigen::Matrix3f c = Unpack(surfel.covariance) +
                              pose.rotation * Unpack(covariance_[i]) * pose.rotation.transpose();
    const Eigen::Matrix3f m = InvertSymmetric(c);
    const Eigen::Vector3f m_e = m * e;
    const float square = std::max(e.dot(m_e), 0.0f);
    mahalanobis_[i] = square;
    const double kernel = 1.0f / (1.0f + square * frame.inverse_kernel_scale);
    const double weight = kernel * surfel.weight;
    const float plane = surfel.normal.dot(e);

    const Eigen::Matrix<double, 27, 1> terms = PackTerms(lever, m, m_e).cast<double>();
    double power = weight;
    for (auto& moment : sums.moment) {
      moment += power * terms;
      power *= static_cast<double>(source_.phase[i]);
    }
    sums.lever += weight * (m.trace() * LeverTerms(lever)).cast<double>();
    sums.weighted_square += weight * static_cast<double>(square);
    sums.kernel_sum += kernel;
    sums.kernel_square_sum += kernel * kernel;
    sums.plane_square += kernel * kernel * static_cast<double>(plane * plane);
    ++sums.matches;
    sums.inliers += std::abs(plane) < inlier_distance_m_ ? 1 : 0;
  }
  return sums;
}

double ScanResiduals::MedianSquare() {
  scratch_.clear();
  for (const float square : mahalanobis_) {
    if (square < kInfinity) scratch_.push_back(square);
  }
  if (scratch_.empty()) return static_cast<double>(kInfinity);
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.end());
  return *middle;
}

}  // namespace covsplat
