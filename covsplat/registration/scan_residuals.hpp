// The data term of Align: residuals of all source points and their sums. Internal to the module.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/parallel.hpp"
#include "covsplat/registration/match_sums.hpp"
#include "covsplat/registration/motion.hpp"
#include "covsplat/registration/preprocess.hpp"
#include "covsplat/registration/target.hpp"

namespace covsplat {

using Vector18d = Eigen::Matrix<double, 18, 1>;

/// Sums over matches. With the residual e, its Jacobian J by a twist of the mid pose, the weight w
/// and M = (C_t + R C_s R^T)^-1: the k-th moment holds the sums of s^k w J^T M J and s^k w J^T M e.
/// Because a twist at mid scan moves a point of phase s by J, the velocity by s J and the
/// acceleration by s^2/2 J, five moments hold the normal equations of all 18 unknowns.
struct PhaseMoments {
  static constexpr int kMoments = 5;
  using Packed = Eigen::Matrix<double, 27, 1>;  ///< 21 of the symmetric matrix, 6 of the vector

  std::array<Packed, kMoments> moment;  ///< axes of the map, moments about the sensor at mid scan
  /// Sums of m, m l and m l l^T (m; x y z; xx xy xz yy yz zz) with m = w trace(M) and l the lever
  /// from the sensor to the point: how much the matches would tell if they faced every way.
  Eigen::Matrix<double, 10, 1> lever = Eigen::Matrix<double, 10, 1>::Zero();
  double weighted_square = 0.0;    ///< sum of w e^T M e
  double kernel_sum = 0.0;         ///< sum of the robust kernel's weights
  double kernel_square_sum = 0.0;  ///< sum of the squares of these weights
  double plane_square = 0.0;       ///< sum of the kernel's weight squared * (n^T e)^2
  std::size_t matches = 0;
  std::size_t inliers = 0;

  PhaseMoments() { moment.fill(Packed::Zero()); }
  PhaseMoments& operator+=(const PhaseMoments& other);

  Matrix6d Matrix(int k) const;
  Vector6d Vector(int k) const;
  /// Inertia of the levers about their mean, axes of the map.
  Eigen::Matrix3d Inertia() const;
};

/// Hessian and gradient of half the weighted squares by [mid pose, twist, acceleration], right
/// perturbation, in the sensor frame at mid scan. The gradient is exact to second order in the
/// motion within the scan, the Hessian (Gauss-Newton) to first.
struct NormalEquations {
  Matrix18d hessian;
  Vector18d gradient;
};
NormalEquations Assemble(const PhaseMoments& moments, const ScanMotion& motion);

/// A scan being matched to a target: keeps the matches from one call to the next.
class ScanResiduals {
 public:
  ScanResiduals(const SourceCloud& source,
                const RegistrationTarget& target,
                double gate_m,
                double inlier_distance_m,
                bool same_side,
                ThreadPool& pool);

  /// Finds the nearest surfels and sums up the matches of every `stride`-th point. The robust
  /// kernel is Cauchy's, 1 / (1 + e^T M e / kernel_scale).
  PhaseMoments Evaluate(const ScanMotion& motion,
                        double kernel_scale,
                        std::size_t stride,
                        ThreadPool& pool);

  /// Median of e^T M e over the matches of the last evaluation, infinite if there are none.
  double MedianSquare();

  std::size_t Size() const { return slot_.size(); }
  const std::vector<int>& Slots() const { return slot_; }
  const std::vector<float>& SquaredDistances() const { return squared_distance_; }

 private:
  struct Frame;
  void Match(std::size_t i, const Eigen::Vector3f& position);
  PhaseMoments SumChunk(const Frame& frame, std::size_t begin, std::size_t end);

  const RegistrationTarget& target_;
  const float squared_gate_;
  const float inlier_distance_m_;
  const bool same_side_;
  std::vector<SourceRecord> source_;       // [N]
  std::vector<int> slot_;                  // [N] nearest surfel, -1 if none
  std::vector<float> squared_distance_;    // [N]
  std::vector<Eigen::Vector3f> searched_;  // [N] position at the last search
  std::vector<float> clearance_m_;         // [N] of the last search
  std::vector<float> mahalanobis_;         // [N] e^T M e
  std::vector<float> scratch_;
};

}  // namespace covsplat
