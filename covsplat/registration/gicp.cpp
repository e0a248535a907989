#include "covsplat/registration/gicp.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "covsplat/registration/motion_prior.hpp"
#include "covsplat/registration/scan_residuals.hpp"
#include "covsplat/registration/step_stretch.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kMinMatches = 20;
constexpr double kMinKernelScale = 1e-12;  // of noise-free data

// Cauchy scale for e^T M e whose median is that of a one-dimensional normal residual (0.455
// sigma^2): matches are point-to-plane in effect.
double KernelScale(double median_square, double width) {
  constexpr double kNoKernel = 1e12;
  return std::clamp(width * width * median_square / 0.455, kMinKernelScale, kNoKernel);
}

int Unknowns(MotionModel model, double duration_s) {
  if (duration_s <= 0.0 || model == MotionModel::kRigid) return 6;
  return model == MotionModel::kVelocity ? 12 : 18;
}

// The prediction may be off by what accelerations do within its horizon.
double Gate(const MotionPrediction& prediction, const GicpConfig& config) {
  constexpr double kSigmas = 3.0;
  const double horizon_s = std::max(prediction.horizon_s, 0.0);
  const double off_m = 0.5 * config.linear_acceleration_mps2 * horizon_s * horizon_s;
  return config.max_correspondence_m + std::min(kSigmas * off_m, config.max_correspondence_m);
}

ScanMotion Moved(const ScanMotion& motion, const Vector18d& step) {
  return {motion.T_map_sensor * SE3::Exp(step.head<6>()),
          motion.twist + step.segment<6>(6),
          motion.acceleration + step.tail<6>()};
}

Vector18d Between(const ScanMotion& from, const ScanMotion& to) {
  Vector18d step;
  step << (from.T_map_sensor.Inverse() * to.T_map_sensor).Log(), to.twist - from.twist,
      to.acceleration - from.acceleration;
  return step;
}

// One registration: the problem and where its iterations stand.
class Aligner {
 public:
  Aligner(const SourceCloud& source,
          const RegistrationTarget& target,
          const MotionPrediction& prediction,
          const GicpConfig& config,
          ThreadPool& pool)
      : target_(target),
        predicted_(prediction.motion),
        config_(config),
        pool_(pool),
        unknowns_(Unknowns(config.motion_model, source.duration_s)),
        prior_(prediction, source.duration_s, config),
        residuals_(source,
                   target,
                   Gate(prediction, config),
                   config.inlier_distance_m,
                   config.same_side,
                   pool) {
    result_.motion = prediction.motion;
  }

  // Most of the way is gone with a part of the points; then few searches are left for all of them.
  AlignResult Run() && {
    if (residuals_.Size() >= kEnoughForCoarse) Iterate(kCoarseStride, 10.0);
    const PhaseMoments moments = Iterate(1, 1.0);
    return Finish(moments);
  }

 private:
  // A step is undone if it makes the median residual worse by this, a stretched one if it makes it
  // worse at all.
  static constexpr double kWorse = 1.5;
  static constexpr double kFirstDamping = 1e-2;
  static constexpr double kMaxDamping = 1e3;
  // Only steps of so many epsilons are stretched: what creeps less, along directions that surfaces
  // hardly hold, ends nearer to the prediction, and trajectories are the better for it.
  static constexpr double kStretchFrom = 30.0;
  static constexpr std::size_t kEnoughForCoarse = 4000;
  static constexpr std::size_t kCoarseStride = 4;
  // Points whose matches change in turns keep steps from becoming small. To be where so many steps
  // began is the end, too.
  static constexpr std::size_t kShortestCycle = 3;
  static constexpr std::size_t kLongestCycle = 12;

  // Gauss-Newton with every `stride`-th point until steps are small (epsilons times `tolerance`).
  PhaseMoments Iterate(std::size_t stride, double tolerance) {
    // Until residuals have been seen there is no scale to judge outliers by.
    if (!std::isfinite(median_)) Evaluate(result_.motion, stride);
    PhaseMoments moments = Evaluate(result_.motion, stride);
    double accepted_median = median_;
    damping_ = 0.0;
    result_.converged = false;
    StepStretch stretch;
    std::deque<ScanMotion> recent;
    while (moments.matches >= kMinMatches && result_.iterations < config_.max_iterations) {
      ++result_.iterations;
      widening_ = std::max(1.0, 0.5 * widening_);
      const Vector18d step = Solve(moments, result_.motion, stride);
      if (!step.allFinite()) break;
      const bool small = IsSmall(step, tolerance);
      const bool settled = widening_ == 1.0;
      const double factor = settled && !IsSmall(step, kStretchFrom) ? stretch.Of(step) : 1.0;
      const ScanMotion candidate = Moved(result_.motion, factor * step);
      const PhaseMoments next = Evaluate(candidate, stride);
      const double worse = factor > 1.0 ? 1.0 : kWorse;
      if (next.matches < kMinMatches || median_ > worse * accepted_median + kMinKernelScale) {
        median_ = accepted_median;
        stretch.Forget();
        if (factor > 1.0) continue;
        damping_ = std::max(10.0 * damping_, kFirstDamping);
        if (damping_ > kMaxDamping) break;
        continue;
      }
      result_.motion = candidate;
      moments = next;
      accepted_median = median_;
      damping_ *= 0.1;
      result_.converged = settled && (small || WasHere(recent, candidate, tolerance));
      recent.push_front(candidate);
      if (recent.size() > kLongestCycle) recent.pop_back();
      if (result_.converged) break;
    }
    return moments;
  }

  /// `recent`: the newest first.
  bool WasHere(const std::deque<ScanMotion>& recent,
               const ScanMotion& motion,
               double tolerance) const {
    for (std::size_t k = kShortestCycle - 1; k < recent.size(); ++k) {
      if (IsSmall(Between(recent[k], motion), tolerance)) return true;
    }
    return false;
  }

  PhaseMoments Evaluate(const ScanMotion& motion, std::size_t stride) {
    const double scale = KernelScale(median_, widening_ * config_.kernel_width);
    PhaseMoments moments = residuals_.Evaluate(motion, scale, stride, pool_);
    median_ = residuals_.MedianSquare();
    return moments;
  }

  // Data and prior, both in units of their variance, with directions that hold nothing tied down.
  Vector18d Solve(const PhaseMoments& moments, const ScanMotion& motion, std::size_t stride) {
    NormalEquations equations = Assemble(moments, motion);
    const double alike =
        std::max(1.0, config_.points_per_measurement / static_cast<double>(stride));
    const double variance = std::max(alike * moments.weighted_square / moments.kernel_sum, 1e-30);
    equations.hessian /= variance;
    equations.gradient /= variance;
    const Eigen::Matrix3d R = motion.T_map_sensor.RotationMatrix();
    const auto weaker_than = [&](double ratio) {
      return FindWeakDirections(equations.hessian.topLeftCorner<6, 6>(),
                                moments.lever[0] / variance,
                                R.transpose() * moments.Inertia() * R / variance,
                                ratio);
    };
    weak_ = weaker_than(config_.degeneracy_ratio);
    const WeakDirections held = weaker_than(config_.hold_ratio);
    information_ = equations.hessian;
    prior_.AddTo(equations, motion);
    posterior_ = equations.hessian;
    Hold(held, equations, motion);
    equations.hessian.diagonal() *= 1.0 + damping_;
    Vector18d step = Vector18d::Zero();
    step.head(unknowns_) = equations.hessian.topLeftCorner(unknowns_, unknowns_)
                               .ldlt()
                               .solve(-equations.gradient.head(unknowns_));
    return step;
  }

  void Hold(const WeakDirections& held,
            NormalEquations& equations,
            const ScanMotion& motion) const {
    constexpr double kStiff = 1e6;
    Vector18d offset;
    offset << (predicted_.T_map_sensor.Inverse() * motion.T_map_sensor).Log(),
        motion.twist - predicted_.twist, motion.acceleration - predicted_.acceleration;
    const auto hold = [&](const Eigen::Vector3d& direction, int at) {
      const double stiffness = kStiff * equations.hessian.diagonal().segment<3>(at % 6).maxCoeff();
      const double along = direction.dot(offset.segment<3>(at));
      equations.hessian.block<3, 3>(at, at) += stiffness * direction * direction.transpose();
      equations.gradient.segment<3>(at) += stiffness * along * direction;
    };
    for (int block = 0; block < 18; block += 6) {
      for (const Eigen::Vector3d& direction : held.rotations) hold(direction, block);
      for (const Eigen::Vector3d& direction : held.translations) hold(direction, block + 3);
    }
  }

  // At the scan's begin, middle and end: the motion within it converges last.
  bool IsSmall(const Vector18d& step, double tolerance) const {
    for (const double s : {-0.5, 0.0, 0.5}) {
      const Vector6d moved = step.head<6>() + s * step.segment<6>(6) + 0.5 * s * s * step.tail<6>();
      if (moved.head<3>().norm() >= tolerance * config_.rotation_epsilon_rad) return false;
      if (moved.tail<3>().norm() >= tolerance * config_.translation_epsilon_m) return false;
    }
    return true;
  }

  AlignResult Finish(const PhaseMoments& moments) {
    result_.squared_distance = residuals_.SquaredDistances();
    result_.surfel = residuals_.Slots();
    for (int& slot : result_.surfel) slot = slot < 0 ? -1 : target_.SurfelOf(slot);
    if (result_.iterations == 0) return std::move(result_);
    result_.correspondences = moments.matches;
    result_.inlier_ratio =
        static_cast<double>(moments.inliers) / static_cast<double>(result_.surfel.size());
    result_.rms_residual_m = std::sqrt(moments.plane_square / moments.kernel_square_sum);
    result_.weak = weak_;
    result_.degenerate_directions =
        static_cast<int>(weak_.rotations.size() + weak_.translations.size());
    result_.information = PoseInformation();
    result_.covariance = Covariance();
    return std::move(result_);
  }

  // Marginalises the motion within the scan, which data and its prior determine.
  Matrix6d PoseInformation() const {
    const int inner = unknowns_ - 6;
    if (inner == 0) return information_.topLeftCorner<6, 6>();
    NormalEquations prior{Matrix18d::Zero(), Vector18d::Zero()};
    prior_.AddTo(prior, result_.motion);
    const Eigen::MatrixXd within = information_.block(6, 6, inner, inner) +
                                   prior.hessian.block(6, 6, inner, inner) +
                                   1e-9 * Eigen::MatrixXd::Identity(inner, inner);
    const Eigen::MatrixXd cross = information_.block(0, 6, 6, inner);
    return information_.topLeftCorner<6, 6>() - cross * within.ldlt().solve(cross.transpose());
  }

  // Directions that neither data nor prior know of become as good as unknown.
  Matrix18d Covariance() const {
    constexpr double kNothing = 1e-6;
    const Eigen::MatrixXd known = posterior_.topLeftCorner(unknowns_, unknowns_) +
                                  kNothing * Eigen::MatrixXd::Identity(unknowns_, unknowns_);
    Matrix18d covariance = Matrix18d::Zero();
    covariance.topLeftCorner(unknowns_, unknowns_) =
        known.llt().solve(Eigen::MatrixXd::Identity(unknowns_, unknowns_));
    return covariance;
  }

  const RegistrationTarget& target_;
  const ScanMotion predicted_;
  const GicpConfig& config_;
  ThreadPool& pool_;
  const int unknowns_;
  const MotionPrior prior_;
  ScanResiduals residuals_;
  AlignResult result_;
  WeakDirections weak_;
  Matrix18d information_ = Matrix18d::Zero();                // of the data
  Matrix18d posterior_ = Matrix18d::Zero();                  // ... and the prior
  double median_ = std::numeric_limits<double>::infinity();  // of e^T M e, last evaluation
  // The kernel starts wide: the median is that of the most common surface, say the ground, and with
  // a poor prediction everything else would be taken for outliers.
  double widening_ = 16.0;
  double damping_ = 0.0;
};

}  // namespace

AlignResult Align(const SourceCloud& source,
                  const RegistrationTarget& target,
                  const MotionPrediction& prediction,
                  const GicpConfig& config,
                  ThreadPool& pool) {
  if (!prediction.motion.IsFinite()) {
    AlignResult result;
    result.motion = prediction.motion;
    result.squared_distance.assign(source.Size(), std::numeric_limits<float>::infinity());
    result.surfel.assign(source.Size(), -1);
    return result;
  }
  return Aligner(source, target, prediction, config, pool).Run();
}

}  // namespace covsplat
