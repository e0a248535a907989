// StepStretch: longer steps for a registration that creeps in one direction. Internal to the
// module.
#pragma once

#include "covsplat/registration/scan_residuals.hpp"

namespace covsplat {

/// Where a surface slides along the one that it is matched to, its matches move along and hold it
/// back: step after step goes the same way and covers only a part of it. Steps that have one
/// direction are stretched to where they would end, as they shrink (Irons and Tuck 1969, Aitken's
/// delta-squared process along a line), and doubled while they do not.
class StepStretch {
 public:
  /// Factor, 1 or more, for a plain step of [mid pose, twist, acceleration] that follows the one
  /// before, which was stretched as this said.
  double Of(const Vector18d& step);

  /// The step before was not made.
  void Forget();

 private:
  Vector18d last_ = Vector18d::Zero();  // plain, m
  double stretch_ = 1.0;
};

}  // namespace covsplat
