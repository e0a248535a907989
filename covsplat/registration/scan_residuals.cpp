#include "covsplat/registration/scan_residuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kGrain = 512;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

double Sum(const MatchSums::Lanes& lanes) {
  return Eigen::Map<const Eigen::Array<float, MatchBatch::kSize, 1>>(lanes.data())
      .cast<double>()
      .sum();
}

PhaseMoments MomentsOf(const MatchSums& sums) {
  PhaseMoments moments;
  for (std::size_t k = 0; k < PhaseMoments::kMoments; ++k) {
    for (std::size_t i = 0; i < MatchSums::kTerms; ++i) {
      moments.moment[k][static_cast<int>(i)] = Sum(sums.moment[k][i]);
    }
  }
  for (std::size_t i = 0; i < MatchSums::kLeverTerms; ++i) {
    moments.lever[static_cast<int>(i)] = Sum(sums.lever[i]);
  }
  moments.weighted_square = Sum(sums.weighted_square);
  moments.kernel_sum = Sum(sums.kernel_sum);
  moments.kernel_square_sum = Sum(sums.kernel_square_sum);
  moments.plane_square = Sum(sums.plane_square);
  moments.matches = static_cast<std::size_t>(Sum(sums.matches));
  moments.inliers = static_cast<std::size_t>(Sum(sums.inliers));
  return moments;
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
  PoseTable poses;  ///< to the axes of the map, about the sensor at mid scan
  MatchSettings settings;
  std::size_t stride;
};

ScanResiduals::ScanResiduals(const SourceCloud& source,
                             const RegistrationTarget& target,
                             double gate_m,
                             double inlier_distance_m,
                             bool same_side,
                             ThreadPool& pool)
    : target_(target),
      squared_gate_(static_cast<float>(gate_m * gate_m)),
      inlier_distance_m_(static_cast<float>(inlier_distance_m)),
      same_side_(same_side),
      source_(source.Size()),
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
      source_[i] = {.point = source.points[i],
                    .phase = source.phase[i],
                    .covariance = SurfaceCovariance(c.axes, c.sigma_m[0], c.sigma_m[1]),
                    .normal = c.axes.col(2)};
    }
  });
}

PhaseMoments ScanResiduals::Evaluate(const ScanMotion& motion,
                                     double kernel_scale,
                                     std::size_t stride,
                                     ThreadPool& pool) {
  const SE3& pose = motion.T_map_sensor;
  const MatchSettings settings{.sensor = (pose.Translation() - target_.OriginMap()).cast<float>(),
                               .inverse_kernel_scale = static_cast<float>(1.0 / kernel_scale),
                               .inlier_distance_m = inlier_distance_m_,
                               .same_side = same_side_};
  const Frame frame{PoseTable(motion, pose.RotationMatrix()), settings, stride};
  return ParallelSum(
      pool,
      (Size() + stride - 1) / stride,
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
  MatchSums sums;
  MatchBatch batch;
  const auto sum_up = [&] {
    MatchSums::Lanes mahalanobis;
    batch.FillUp();
    SumMatches(batch, frame.settings, sums, mahalanobis);
    for (std::size_t k = 0; k < batch.Size(); ++k) {
      mahalanobis_[batch.IndexOf(k)] = mahalanobis[k];
    }
    batch.Clear();
  };
  for (std::size_t k = begin; k < end; ++k) {
    const std::size_t i = k * frame.stride;
    const Eigen::Matrix4f pose = frame.poses.MatrixAt(source_[i].phase);
    const Eigen::Vector4f lever = pose * source_[i].point.homogeneous();
    Match(i, lever.head<3>() + frame.settings.sensor);
    if (slot_[i] < 0) {
      mahalanobis_[i] = kInfinity;
      continue;
    }
    batch.Add(i, source_[i], target_.At(slot_[i]), pose);
    if (batch.IsFull()) sum_up();
  }
  if (batch.Size() > 0) sum_up();
  return MomentsOf(sums);
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
