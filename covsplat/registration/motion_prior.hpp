// The prior term of Align: what physics says about the motion. Internal to the module.
#pragma once

#include "covsplat/registration/gicp.hpp"
#include "covsplat/registration/scan_residuals.hpp"

namespace covsplat {

/// Half the squares, normalised to unit variance, of three differences: of the pose from the
/// predicted one, of the velocity at the scan's begin from the predicted one, which is that at the
/// end of the scan before, and of the acceleration from none. Their covariance is that of the
/// prediction, which makes the whole a Kalman filter over the scans, and what the configured
/// accelerations do within the prediction's horizon, or the scan's duration. Without a horizon it
/// is silent.
class MotionPrior {
 public:
  MotionPrior(const MotionPrediction& prediction, double duration_s, const GicpConfig& config);

  /// Adds to equations of `ScanMotion`s near `motion`.
  void AddTo(NormalEquations& equations, const ScanMotion& motion) const;

 private:
  const ScanMotion predicted_;
  Matrix12d begin_information_ = Matrix12d::Zero();  ///< of the pose and the velocity at the begin
  Matrix6d acceleration_information_ = Matrix6d::Zero();
};

}  // namespace covsplat
