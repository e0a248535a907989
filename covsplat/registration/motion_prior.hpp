// The prior term of Align: what physics says about the motion. Internal to the module.
#pragma once

#include "covsplat/registration/gicp.hpp"
#include "covsplat/registration/scan_residuals.hpp"

namespace covsplat {

/// Half the squares, normalised to unit variance, of three differences from the prediction: where
/// the scan begins (where the previous one ended), how fast the sensor moves then, and how the
/// velocity changes. A prediction is a continuation, so this ties a scan to the one before without
/// knowing it. It is silent for the rigid model, whose twist is not estimated. Their standard
/// deviations are expected accelerations times the scan's duration.
class MotionPrior {
 public:
  MotionPrior(const MotionPrediction& prediction, double duration_s, const GicpConfig& config);

  /// Adds to equations of `ScanMotion`s near `motion`, scaled by `factor`.
  void AddTo(NormalEquations& equations, const ScanMotion& motion, double factor) const;

 private:
  const ScanMotion predicted_;
  bool active_ = false;
  Vector6d begin_information_;
  Vector6d velocity_information_;
  Vector6d acceleration_information_;
};

}  // namespace covsplat
