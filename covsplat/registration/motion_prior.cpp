#include "covsplat/registration/motion_prior.hpp"

#include <algorithm>

namespace covsplat {
namespace {

// Of a change by the configured accelerations, times `factor` [s^2].
Vector6d Information(const GicpConfig& config, double factor) {
  const double rotation = factor * config.angular_acceleration_radps2;
  const double translation = factor * config.linear_acceleration_mps2;
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (rotation * rotation)),
      Eigen::Vector3d::Constant(1.0 / (translation * translation));
  return information;
}

using Jacobian = Eigen::Matrix<double, 6, 18>;

void AddSquares(NormalEquations& equations,
                const Jacobian& jacobian,
                const Vector6d& residual,
                const Vector6d& information) {
  const Eigen::Matrix<double, 18, 6> weighted = jacobian.transpose() * information.asDiagonal();
  equations.hessian += weighted * jacobian;
  equations.gradient += weighted * residual;
}

}  // namespace

MotionPrior::MotionPrior(const MotionPrediction& prediction,
                         double duration_s,
                         const GicpConfig& config)
    : predicted_(prediction.motion) {
  const double horizon_s = prediction.horizon_s;
  if (!(horizon_s > 0.0)) return;
  pose_information_ = Information(config, 0.5 * horizon_s * horizon_s);
  if (!(duration_s > 0.0)) return;
  velocity_information_ = Information(config, std::max(horizon_s, duration_s) * duration_s);
  acceleration_information_ = Information(config, duration_s * duration_s);
}

void MotionPrior::AddTo(NormalEquations& equations, const ScanMotion& motion) const {
  const Matrix6d zero = Matrix6d::Zero();
  const Matrix6d identity = Matrix6d::Identity();
  Jacobian jacobian;
  jacobian << identity, zero, zero;
  const Vector6d moved = (predicted_.T_map_sensor.Inverse() * motion.T_map_sensor).Log();
  AddSquares(equations, jacobian, moved, pose_information_);
  jacobian << zero, identity, -0.5 * identity;
  const Vector6d velocity = motion.twist - 0.5 * motion.acceleration;
  const Vector6d predicted_velocity = predicted_.twist - 0.5 * predicted_.acceleration;
  AddSquares(equations, jacobian, velocity - predicted_velocity, velocity_information_);
  jacobian << zero, zero, identity;
  AddSquares(equations, jacobian, motion.acceleration, acceleration_information_);
}

}  // namespace covsplat
