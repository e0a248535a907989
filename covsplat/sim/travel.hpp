// Travel: a journey along a path, smooth in time.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "covsplat/sim/path.hpp"

namespace covsplat {

/// Stands still, follows the path, stands still. Where the traveller is, is a cubic B-spline in
/// time, so velocity and acceleration are continuous.
class Travel {
 public:
  struct State {
    Eigen::Vector3d ground;    ///< [m] the point below the traveller
    double heading_rad = 0.0;  ///< unwrapped
    double slope = 0.0;        ///< rise over run of the way
    double vigour = 0.0;       ///< 0 at rest to 1 at full speed
  };

  /// `speed_mps` is asked along the way, from 0 to `length_m`, which may be several laps of a
  /// closed path; vigour is the share of `full_speed_mps`.
  Travel(const Path& path,
         double length_m,
         const std::function<double(double)>& speed_mps,
         double full_speed_mps);

  double Duration() const;
  State At(double time_s) const;

 private:
  using Control = Eigen::Matrix<double, 6, 1>;  // ground, heading, vigour, slope
  std::vector<Control> controls_;
};

}  // namespace covsplat
