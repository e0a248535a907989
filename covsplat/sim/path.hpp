// Smooth curves through space, for whatever moves through a simulated world.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"

namespace covsplat {

/// Uniform cubic B-spline at `position` knots: value, velocity and acceleration are continuous.
/// `control_at(i)` gives the control point i; all from floor(position) to floor(position) + 3
/// count.
template <class Vector, class ControlAt>
Vector CubicBSpline(double position, const ControlAt& control_at) {
  const double floor = std::floor(position);
  const double s = position - floor;
  const auto knot = static_cast<std::ptrdiff_t>(floor);
  const double r = 1.0 - s;
  return (r * r * r * control_at(knot) +
          (4.0 - 6.0 * s * s + 3.0 * s * s * s) * control_at(knot + 1) +
          (4.0 - 6.0 * r * r + 3.0 * r * r * r) * control_at(knot + 2) +
          s * s * s * control_at(knot + 3)) /
         6.0;
}

/// The way through a world that its walkers or vehicles take.
struct Route {
  std::vector<Eigen::Vector3d> controls;  ///< [m] on the ground, of a cubic B-spline
  bool closed = true;
  double jitter_m = 0.03;  ///< how far a seed may move a control point to each side
  /// Height [m] of the ground, to which z of the controls is added; none: zero.
  std::function<double(double, double)> ground;
};

/// Control points every `spacing_m` or less along straight lines between corners, so that the
/// spline follows the lines and rounds each corner within about that length.
std::vector<Eigen::Vector3d> AlongLines(const std::vector<Eigen::Vector3d>& corners,
                                        bool closed,
                                        double spacing_m);

/// Control points every `spacing_m` or less along straight lines between corners, each a quarter
/// turn to either side, and along arcs of `radius_m` round the corners.
std::vector<Eigen::Vector3d> AlongStreets(const std::vector<Eigen::Vector2d>& corners,
                                          bool closed,
                                          double radius_m,
                                          double spacing_m);

/// The control points of a route, each moved in the plane by up to `jitter_m` per axis.
std::vector<Eigen::Vector3d> Jittered(const Route& route, Rng& rng);

/// A route's curve by arc length [m]; needs four controls or more, or two if it is open.
class Path {
 public:
  Path(std::vector<Eigen::Vector3d> controls, bool closed);

  bool Closed() const { return closed_; }
  double Length() const { return distance_m_.back(); }

  /// A closed path goes round and round, an open one rests at its ends.
  Eigen::Vector3d At(double distance_m) const;

  /// Direction of travel in the plane over half a metre, in (-pi, pi].
  double Heading(double distance_m) const;

  /// Rise over run, over two metres.
  double Slope(double distance_m) const;

  /// How fast the heading turns, rad/m, unsigned, over `window_m`.
  double Curvature(double distance_m, double window_m = 1.0) const;

 private:
  bool closed_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<double> distance_m_;
};

}  // namespace covsplat
