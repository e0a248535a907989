#include "covsplat/sim/path.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr int kSamplesPerControl = 200;

Eigen::Vector3d OnTheGround(const Eigen::Vector2d& point) { return {point.x(), point.y(), 0.0}; }

// From the end of a straight that goes `along`, a quarter turn towards `aside`.
void AppendArc(const Eigen::Vector2d& from,
               const Eigen::Vector2d& along,
               const Eigen::Vector2d& aside,
               double radius_m,
               double spacing_m,
               std::vector<Eigen::Vector3d>& controls) {
  const double quarter_m = 0.5 * std::numbers::pi * radius_m;
  const int steps = std::max(1, static_cast<int>(std::ceil(quarter_m / spacing_m)));
  for (int k = 0; k < steps; ++k) {
    const double turn = 0.5 * std::numbers::pi * k / steps;
    controls.push_back(
        OnTheGround(from + radius_m * (std::sin(turn) * along + (1.0 - std::cos(turn)) * aside)));
  }
}

}  // namespace

std::vector<Eigen::Vector3d> AlongLines(const std::vector<Eigen::Vector3d>& corners,
                                        bool closed,
                                        double spacing_m) {
  std::vector<Eigen::Vector3d> controls;
  const std::size_t lines = closed ? corners.size() : corners.size() - 1;
  for (std::size_t i = 0; i < lines; ++i) {
    const Eigen::Vector3d& from = corners[i];
    const Eigen::Vector3d line = corners[(i + 1) % corners.size()] - from;
    const int steps = std::max(1, static_cast<int>(std::ceil(line.norm() / spacing_m)));
    for (int k = 0; k < steps; ++k) controls.push_back(from + line * k / steps);
  }
  if (!closed) controls.push_back(corners.back());
  return controls;
}

std::vector<Eigen::Vector3d> AlongStreets(const std::vector<Eigen::Vector2d>& corners,
                                          bool closed,
                                          double radius_m,
                                          double spacing_m) {
  std::vector<Eigen::Vector3d> controls;
  const std::size_t n = corners.size();
  const std::size_t sides = closed ? n : n - 1;
  const auto along = [&](std::size_t side) -> Eigen::Vector2d {
    return (corners[(side + 1) % n] - corners[side % n]).normalized();
  };
  for (std::size_t side = 0; side < sides; ++side) {
    const bool bends_before = closed || side > 0;
    const bool bends_after = closed || side + 1 < sides;
    const Eigen::Vector2d from = corners[side] + (bends_before ? radius_m : 0.0) * along(side);
    const Eigen::Vector2d to =
        corners[(side + 1) % n] - (bends_after ? radius_m : 0.0) * along(side);
    const int steps = static_cast<int>(std::ceil((to - from).norm() / spacing_m));
    for (int k = 0; k < steps; ++k) {
      controls.push_back(OnTheGround(from + (to - from) * k / steps));
    }
    if (bends_after) AppendArc(to, along(side), along(side + 1), radius_m, spacing_m, controls);
  }
  if (!closed) controls.push_back(OnTheGround(corners.back()));
  return controls;
}

std::vector<Eigen::Vector3d> Jittered(const Route& route, Rng& rng) {
  std::vector<Eigen::Vector3d> controls = route.controls;
  for (Eigen::Vector3d& point : controls) {
    point.y() += rng.Uniform(-route.jitter_m, route.jitter_m);
    point.x() += rng.Uniform(-route.jitter_m, route.jitter_m);
  }
  return controls;
}

Path::Path(std::vector<Eigen::Vector3d> controls, bool closed) : closed_(closed) {
  COVSPLAT_CHECK(controls.size() >= (closed ? 4u : 2u));
  const auto n = static_cast<std::ptrdiff_t>(controls.size());
  const auto control_at = [&](std::ptrdiff_t i) -> const Eigen::Vector3d& {
    return controls[static_cast<std::size_t>(closed ? (i + n) % n
                                                    : std::clamp<std::ptrdiff_t>(i, 0, n - 1))];
  };
  // An open curve begins and ends where three controls coincide.
  const double first = closed ? 0.0 : -2.0;
  const auto samples = (closed ? n : n + 1) * kSamplesPerControl;
  for (std::ptrdiff_t i = 0; i <= samples; ++i) {
    const auto k = closed ? i % samples : i;
    const double position = first + static_cast<double>(k) / kSamplesPerControl;
    const auto point = CubicBSpline<Eigen::Vector3d>(position, control_at);
    distance_m_.push_back(points_.empty() ? 0.0
                                          : distance_m_.back() + (point - points_.back()).norm());
    points_.push_back(point);
  }
  COVSPLAT_CHECK(Length() > 0.0);
}

Eigen::Vector3d Path::At(double distance_m) const {
  const double wrapped = closed_ ? distance_m - Length() * std::floor(distance_m / Length())
                                 : std::clamp(distance_m, 0.0, Length());
  const auto after = std::upper_bound(distance_m_.begin() + 1, distance_m_.end() - 1, wrapped);
  const auto i = static_cast<std::size_t>(after - distance_m_.begin());
  const double step = distance_m_[i] - distance_m_[i - 1];
  if (step == 0.0) return points_[i];
  const double s = (wrapped - distance_m_[i - 1]) / step;
  return points_[i - 1] + s * (points_[i] - points_[i - 1]);
}

double Path::Heading(double distance_m) const {
  const Eigen::Vector3d ahead = At(distance_m + 0.25) - At(distance_m - 0.25);
  return std::atan2(ahead.y(), ahead.x());
}

double Path::Slope(double distance_m) const {
  const Eigen::Vector3d ahead = At(distance_m + 1.0) - At(distance_m - 1.0);
  const double run = ahead.head<2>().norm();
  return run > 0.0 ? ahead.z() / run : 0.0;
}

double Path::Curvature(double distance_m, double window_m) const {
  const double turn = Heading(distance_m + 0.5 * window_m) - Heading(distance_m - 0.5 * window_m);
  return std::abs(std::remainder(turn, 2.0 * std::numbers::pi)) / window_m;
}

}  // namespace covsplat
