// The sensor's motion during one scan, and what follows from it: prediction and deskewing.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/se3.hpp"
#include "covsplat/registration/deskew.hpp"

namespace covsplat {

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Matrix18d = Eigen::Matrix<double, 18, 18>;

/// Motion of the sensor during one scan, second order in the phase s in [-0.5, 0.5]: at s the
/// sensor is at `T_map_sensor * Exp(s * twist + s^2 / 2 * acceleration)`. Tangent vectors are in
/// the sensor frame at mid scan, per scan duration and per duration squared.
struct ScanMotion {
  SE3 T_map_sensor;  ///< at mid scan
  Vector6d twist = Vector6d::Zero();
  Vector6d acceleration = Vector6d::Zero();

  /// T_mid_s: maps what was measured at phase s to the sensor frame at mid scan.
  SE3 Within(double phase) const {
    return SE3::Exp(phase * twist + 0.5 * phase * phase * acceleration);
  }
  /// T_map_s.
  SE3 At(double phase) const { return T_map_sensor * Within(phase); }
  bool IsFinite() const {
    return T_map_sensor.IsFinite() && twist.allFinite() && acceleration.allFinite();
  }
};

/// A motion expected before looking at the scan.
struct MotionPrediction {
  ScanMotion motion;
  /// How far it reaches beyond what is known: from the middle of the last tracked scan to the
  /// middle of this one. 0 or less for "no idea" (the motion prior is switched off).
  double horizon_s = 0.0;
  /// Of the pose and of the twist at the scan's begin, from that of the motion before.
  Matrix12d covariance = Matrix12d::Zero();
};

/// Continues a motion over `gap_s` from the middle of one scan to the middle of the next, at the
/// velocity it ended with. An acceleration that went on from scan to scan would feed on its own
/// errors. `covariance` is that of the previous pose, twist and acceleration.
MotionPrediction PredictMotion(const ScanMotion& previous,
                               double previous_duration_s,
                               double duration_s,
                               double gap_s,
                               const Matrix18d& covariance = Matrix18d::Zero());

/// `T_a * T_mid_s` in float for all phases of a scan: a table of poses, linear in between. At 256
/// intervals the interpolation is within 1e-6 rad for turns below 0.7 rad per scan.
class PoseTable {
 public:
  struct Pose {
    Eigen::Matrix3f rotation;
    Eigen::Vector3f translation;
  };

  /// Poses `rotation * T_mid_s`; pass the identity to deskew to mid scan.
  PoseTable(const ScanMotion& motion, const Eigen::Matrix3d& rotation);

  Pose At(float phase) const {
    const Eigen::Matrix4f matrix = MatrixAt(phase);
    return {matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()};
  }
  /// Rotation and translation above a row of zeros.
  Eigen::Matrix4f MatrixAt(float phase) const {
    const Place place = PlaceOf(phase);
    return entries_[place.index] +
           place.fraction * (entries_[place.index + 1] - entries_[place.index]);
  }

  /// x y z 0 of a point measured at a phase.
  Eigen::Vector4f Move(float phase, const Eigen::Vector3f& point) const {
    const Place place = PlaceOf(phase);
    const Eigen::Vector4f homogeneous(point.x(), point.y(), point.z(), 1.0f);
    const Eigen::Vector4f before = entries_[place.index] * homogeneous;
    const Eigen::Vector4f after = entries_[place.index + 1] * homogeneous;
    return before + place.fraction * (after - before);
  }

 private:
  static constexpr int kIntervals = 256;
  /// The pose above a row that is not used: columns of four are what processors have vectors for.
  using Entry = Eigen::Matrix4f;
  struct Place {
    std::size_t index;
    float fraction;
  };

  static Place PlaceOf(float phase) {
    const float position = (phase + 0.5f) * static_cast<float>(kIntervals);
    const float clamped = std::min(std::max(position, 0.0f), static_cast<float>(kIntervals) - 0.5f);
    const auto index = static_cast<std::size_t>(clamped);
    return {index, position - static_cast<float>(index)};
  }

  std::array<Entry, kIntervals + 1> entries_;
};

/// Points brought from their own times to the sensor frame at mid scan. An empty `phase` means all
/// points were measured at mid scan.
std::vector<Eigen::Vector3f> Deskew(std::span<const Eigen::Vector3f> points,
                                    std::span<const float> phase,
                                    const ScanMotion& motion);
/// The same by a table of the motion, which serves several sets of points.
std::vector<Eigen::Vector3f> Deskew(std::span<const Eigen::Vector3f> points,
                                    std::span<const float> phase,
                                    const PoseTable& poses_mid);

}  // namespace covsplat
