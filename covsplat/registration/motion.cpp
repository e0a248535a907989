#include "covsplat/registration/motion.hpp"

#include "covsplat/core/check.hpp"

namespace covsplat {

MotionPrediction PredictMotion(const ScanMotion& previous,
                               double previous_duration_s,
                               double duration_s,
                               double gap_s,
                               const Matrix18d& covariance) {
  MotionPrediction prediction;
  if (!(previous_duration_s > 0.0 && duration_s > 0.0 && gap_s > 0.0)) {
    prediction.motion.T_map_sensor = previous.T_map_sensor;
    return prediction;
  }
  // Units of the previous scan's duration, counted from that scan's end.
  const double length = duration_s / previous_duration_s;
  const double middle = gap_s / previous_duration_s - 0.5;
  const Vector6d end_velocity = previous.twist + 0.5 * previous.acceleration;
  prediction.motion.T_map_sensor = previous.At(0.5) * SE3::Exp(middle * end_velocity);
  prediction.motion.twist = length * end_velocity;
  prediction.horizon_s = gap_s;
  // What the previous pose, twist and acceleration do to the pose in the middle and to the twist.
  const Matrix6d to_new =
      (prediction.motion.T_map_sensor.Inverse() * previous.T_map_sensor).Adjoint();
  Eigen::Matrix<double, 12, 18> transition;
  transition << to_new, (0.5 + middle) * to_new, (0.125 + 0.5 * middle) * to_new,  //
      Matrix6d::Zero(), length * to_new, 0.5 * length * to_new;
  prediction.covariance = transition * covariance * transition.transpose();
  return prediction;
}

PoseTable::PoseTable(const ScanMotion& motion, const Eigen::Matrix3d& rotation) {
  const bool still = motion.twist.isZero(0.0) && motion.acceleration.isZero(0.0);
  for (int k = 0; k <= kIntervals; ++k) {
    if (still && k > 0) {
      entries_[static_cast<std::size_t>(k)] = entries_[0];
      continue;
    }
    const SE3 pose = motion.Within(static_cast<double>(k) / kIntervals - 0.5);
    Entry& entry = entries_[static_cast<std::size_t>(k)];
    entry.setZero();
    entry.topLeftCorner<3, 3>() = (rotation * pose.RotationMatrix()).cast<float>();
    entry.topRightCorner<3, 1>() = (rotation * pose.Translation()).cast<float>();
  }
}

std::vector<Eigen::Vector3f> Deskew(std::span<const Eigen::Vector3f> points,
                                    std::span<const float> phase,
                                    const ScanMotion& motion) {
  return Deskew(points, phase, PoseTable(motion, Eigen::Matrix3d::Identity()));
}

std::vector<Eigen::Vector3f> Deskew(std::span<const Eigen::Vector3f> points,
                                    std::span<const float> phase,
                                    const PoseTable& poses_mid) {
  COVSPLAT_CHECK(phase.empty() || phase.size() == points.size());
  std::vector<Eigen::Vector3f> deskewed(points.begin(), points.end());
  if (phase.empty()) return deskewed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    deskewed[i] = poses_mid.Move(phase[i], points[i]).head<3>();
  }
  return deskewed;
}

}  // namespace covsplat
