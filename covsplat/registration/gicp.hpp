// Align: continuous-time generalised ICP of one scan to a set of surfels (paper eqs. 1 to 5).
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/registration/degeneracy.hpp"
#include "covsplat/registration/motion.hpp"
#include "covsplat/registration/preprocess.hpp"
#include "covsplat/registration/target.hpp"

namespace covsplat {

struct GicpConfig {
  double max_correspondence_m = 1.0;
  int max_iterations = 100;
  double rotation_epsilon_rad = 5e-5;
  double translation_epsilon_m = 2e-4;
  double kernel_width = 2.0;
  double inlier_distance_m = 0.1;
  double degeneracy_ratio = 0.02;
  double hold_ratio = 0.002;
  MotionModel motion_model = MotionModel::kAcceleration;  ///< the tracker takes `deskew.refine`
  bool same_side = true;
  double angular_acceleration_radps2 = 8.0;
  double linear_acceleration_mps2 = 4.0;
  double points_per_measurement = 8.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("max_correspondence_m",
            c.max_correspondence_m,
            Range{0.01, 20.0},
            "match points to surfels nearer than this, and up to twice as far where the prediction "
            "reaches far ahead");
    v.Field("same_side",
            c.same_side,
            "do not match surfaces that face opposite ways: the two sides of a wall or a floor");
    v.Field("max_iterations", c.max_iterations, Range{1, 200}, "Gauss-Newton steps at most");
    v.Field("rotation_epsilon_rad",
            c.rotation_epsilon_rad,
            Range{0.0, 1.0},
            "converged when a step turns the sensor, at any time of the scan, less than this");
    v.Field("translation_epsilon_m",
            c.translation_epsilon_m,
            Range{0.0, 1.0},
            "... and moves less than this");
    v.Field("kernel_width",
            c.kernel_width,
            Range{0.1, 100.0},
            "width of the robust kernel in robust standard deviations of the residual");
    v.Field("inlier_distance_m",
            c.inlier_distance_m,
            Range{1e-3, 10.0},
            "a match is an inlier when it is this near to its surfel's plane");
    v.Field("degeneracy_ratio",
            c.degeneracy_ratio,
            Range{0.0, 1.0},
            "directions with less than this share of the information that surfaces facing every "
            "way would give are reported as degenerate; the motion prior weighs the more in them");
    v.Field("hold_ratio",
            c.hold_ratio,
            Range{0.0, 1.0},
            "... and with less than this share they keep the prediction");
    v.Field("angular_acceleration_radps2",
            c.angular_acceleration_radps2,
            Range{0.01, 1000.0},
            "motion prior: standard deviation of the angular acceleration");
    v.Field("linear_acceleration_mps2",
            c.linear_acceleration_mps2,
            Range{0.01, 1000.0},
            "motion prior: standard deviation of the linear acceleration");
    v.Field("points_per_measurement",
            c.points_per_measurement,
            Range{1.0, 10000.0},
            "neighbouring points err alike: so many count as one measurement against the prior");
  }
};

/// Outcome of a registration. Without enough matches the motion is the prediction and everything
/// else is zero.
struct AlignResult {
  ScanMotion motion;
  /// Of the pose at mid scan, with the motion within the scan marginalised out. Right perturbation
  /// [rad, m], in 1/rad^2 and 1/m^2, from the residuals' own variance and
  /// `points_per_measurement`; it takes the map as perfect.
  Matrix6d information = Matrix6d::Zero();
  /// Of the pose, the twist and the acceleration, from the residuals and the prior.
  Matrix18d covariance = Matrix18d::Zero();
  int iterations = 0;
  bool converged = false;
  std::size_t correspondences = 0;      ///< source points with a surfel within the gate
  double inlier_ratio = 0.0;            ///< inliers over all source points
  double rms_residual_m = 0.0;          ///< point to plane; tails fade by the kernel squared
  std::vector<float> squared_distance;  ///< [source] to the nearest surfel's mean, inf if unmatched
  std::vector<int> surfel;              ///< [source] the nearest surfel's index, -1 if unmatched

  /// Directions of the mid pose that the scan hardly determines.
  int degenerate_directions = 0;
  WeakDirections weak;  ///< which these are, sensor frame at mid scan
};

/// Estimates the motion of the sensor during a scan. Bit-identical for any number of threads.
///
/// A map made of scans that were deskewed wrongly, all in the same way, fits further scans that are
/// deskewed as wrongly: only the prior's continuity from scan to scan tells. So a map should not
/// begin with a scan whose motion is unknown: align the second scan to the first one as if both
/// were rigid, take the step between them as the first one's twist, and make its surfels anew.
AlignResult Align(const SourceCloud& source,
                  const RegistrationTarget& target,
                  const MotionPrediction& prediction,
                  const GicpConfig& config,
                  ThreadPool& pool);

}  // namespace covsplat
