#include "covsplat/registration/motion_prior.hpp"

namespace covsplat {
namespace {

Vector6d Information(double sigma_rotation, double sigma_translation) {
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (sigma_rotation * sigma_rotation)),
      Eigen::Vector3d::Constant(1.0 / (sigma_translation * sigma_translation));
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
    : predicted_(prediction.motion),
      active_(config.motion_model != MotionModel::kRigid && prediction.sigma_scale > 0.0 &&
              duration_s > 0.0) {
  if (!active_) return;
  const double scale = prediction.sigma_scale;
  const double change = scale * duration_s * duration_s;  // of velocity per scan, from acceleration
  begin_information_ =
      Information(scale * config.begin_rotation_rad, scale * config.begin_translation_m);
  velocity_information_ = acceleration_information_ = Information(
      change * config.angular_acceleration_radps2, change * config.linear_acceleration_mps2);
}

void MotionPrior::AddTo(NormalEquations& equations, const ScanMotion& motion, double factor) const {
  if (!active_) return;
  const Matrix6d identity = Matrix6d::Identity();
  const SE3 begin = motion.Within(-0.5);
  Jacobian jacobian;
  jacobian << begin.Inverse().Adjoint(), -0.5 * identity, 0.125 * identity;
  AddSquares(equations,
             jacobian,
             (predicted_.At(-0.5).Inverse() * motion.T_map_sensor * begin).Log(),
             factor * begin_information_);
  jacobian << Matrix6d::Zero(), identity, -0.5 * identity;
  const Vector6d velocity = motion.twist - 0.5 * motion.acceleration;
  const Vector6d predicted_velocity = predicted_.twist - 0.5 * predicted_.acceleration;
  AddSquares(equations, jacobian, velocity - predicted_velocity, factor * velocity_information_);
  jacobian << Matrix6d::Zero(), Matrix6d::Zero(), identity;
  AddSquares(equations,
             jacobian,
             motion.acceleration - predicted_.acceleration,
             factor * acceleration_information_);
}

}  // namespace covsplat
