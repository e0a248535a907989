// Odometry noise: how sure the way that was tracked is.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/loops/pose_graph.hpp"

namespace covsplat {

struct OdometryNoiseConfig {
  double sigma_m = 0.002;
  double sigma_deg = 0.005;
  double weak_sigma_m = 0.1;
  double weak_sigma_deg = 0.3;
  double max_factor = 10.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("sigma_m",
            c.sigma_m,
            Range{1e-6, 10.0},
            "standard deviation of the way after 1 m, beside that of registration");
    v.Field("sigma_deg", c.sigma_deg, Range{1e-6, 90.0}, "... of the turn after 1 m");
    v.Field("weak_sigma_m",
            c.weak_sigma_m,
            Range{1e-6, 100.0},
            "of the way after 1 m in directions that surfaces do not hold");
    v.Field("weak_sigma_deg", c.weak_sigma_deg, Range{1e-6, 180.0}, "... and of such turns");
    v.Field("max_factor",
            c.max_factor,
            Range{1.0, 1000.0},
            "all of these may be so many times larger, if loops say so");
  }
};

/// Of a step of the way, right perturbation at its end [rad, m]: what the registration of its end
/// left open, and what adds up at random on the way. `information`: of that registration; zero in
/// directions that surfaces do not hold, nothing if the step was given.
Matrix6d StepCovariance(const std::optional<Matrix6d>& information,
                        double way_m,
                        const OdometryNoiseConfig& config);

/// The way by odometry alone, with what is known of the way between any two of its poses.
class OdometryChain {
 public:
  /// `covariance`: of the step from the pose before.
  void Append(const SE3& T_odom_node, const Matrix6d& covariance);

  std::size_t Size() const { return T_odom_node_.size(); }
  const SE3& PoseOf(int node) const { return T_odom_node_[static_cast<std::size_t>(node)]; }

  /// e^T (scale C + L)^-1 e: e is what odometry and a loop differ by, C and L their covariances.
  double SquaredError(const PoseEdge& loop, double scale) const;

  /// By how much the covariances have to be scaled, at least 1 and at most `max_scale`, for the
  /// loops' mean squared error to be what it should be.
  double ScaleBy(std::span<const PoseEdge> loops, double max_scale) const;

 private:
  std::vector<SE3> T_odom_node_;
  /// [nodes] sum over the steps so far, perturbations taken to the origin of odometry: the
  /// covariance of a way is a difference of two.
  std::vector<Matrix6d> covariance_at_origin_;
};

}  // namespace covsplat
