#include "covsplat/registration/motion_prior.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace covsplat {
namespace {

// Of a change by the configured accelerations, times `factor` [s^2].
Vector6d Variance(const GicpConfig& config, double factor) {
  const double rotation = factor * config.angular_acceleration_radps2;
  const double translation = factor * config.linear_acceleration_mps2;
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(rotation * rotation),
      Eigen::Vector3d::Constant(translation * translation);
  return variance;
}

}  // namespace

MotionPrior::MotionPrior(const MotionPrediction& prediction,
                         double duration_s,
                         const GicpConfig& config)
    : predicted_(prediction.motion) {
  const double horizon_s = prediction.horizon_s;
  if (!(horizon_s > 0.0)) return;
  const Vector6d pose_variance = Variance(config, 0.5 * horizon_s * horizon_s);
  if (!(duration_s > 0.0)) {
    begin_information_.topLeftCorner<6, 6>() = pose_variance.cwiseInverse().asDiagonal();
    return;
  }
  Matrix12d covariance = prediction.covariance;
  covariance.diagonal().head<6>() += pose_variance;
  covariance.diagonal().tail<6>() += Variance(config, std::max(horizon_s, duration_s) * duration_s);
  begin_information_ = covariance.llt().solve(Matrix12d::Identity());
  acceleration_information_ = Variance(config, duration_s * duration_s).cwiseInverse().asDiagonal();
}

void MotionPrior::AddTo(NormalEquations& equations, const ScanMotion& motion) const {
  const Matrix6d zero = Matrix6d::Zero();
  const Matrix6d identity = Matrix6d::Identity();
  Eigen::Matrix<double, 12, 18> jacobian;
  jacobian << identity, zero, zero,  //
      zero, identity, -0.5 * identity;
  Eigen::Matrix<double, 12, 1> residual;
  residual << (predicted_.T_map_sensor.Inverse() * motion.T_map_sensor).Log(),
      motion.twist - 0.5 * motion.acceleration - predicted_.twist + 0.5 * predicted_.acceleration;
  const Eigen::Matrix<double, 18, 12> weighted = jacobian.transpose() * begin_information_;
  equations.hessian += weighted * jacobian;
  equations.gradient += weighted * residual;
  equations.hessian.bottomRightCorner<6, 6>() += acceleration_information_;
  equations.gradient.tail<6>() += acceleration_information_ * motion.acceleration;
}

}  // namespace covsplat
