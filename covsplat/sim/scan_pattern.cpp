#include "covsplat/sim/scan_pattern.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;

// Each prism bends the beam by half the cone's angle, in the direction that it has turned to.
Eigen::Vector3f RosetteRay(const RosettePattern& rosette, double time_s) {
  const double bend_rad = 0.5 * rosette.half_angle_deg * kPi / 180.0;
  const double fast = 2.0 * kPi * rosette.fast_prism_hz * time_s;
  const double slow = 2.0 * kPi * rosette.slow_prism_hz * time_s;
  const double left = bend_rad * (std::cos(fast) + std::cos(slow));
  const double up = bend_rad * (std::sin(fast) + std::sin(slow));
  const double angle = std::hypot(left, up);
  const double share = angle > 0.0 ? std::sin(angle) / angle : 1.0;
  return Eigen::Vector3d(std::cos(angle), share * left, share * up).cast<float>();
}

}  // namespace

ScanPattern::ScanPattern(const SimulatedLidarConfig& config)
    : rosette_(config.rosette), scan_rate_hz_(config.scan_rate_hz) {
  if (config.kind == LidarKind::kSpinning) {
    spinning_ = ModelOf(config);
    firings_ = config.columns;
    rays_ = config.rows;
  } else {
    firings_ = static_cast<int>(config.rosette.points_per_s / config.scan_rate_hz);
    rays_ = 1;
  }
}

float ScanPattern::TimeOffset(int firing) const {
  return static_cast<float>(((firing + 0.5) / firings_ - 0.5) / scan_rate_hz_);
}

Eigen::Vector3f ScanPattern::Ray(int scan, int firing, int ray) const {
  if (spinning_) return spinning_->RayOf(ray, firing);
  const auto pulse = static_cast<std::int64_t>(scan) * firings_ + firing;
  return RosetteRay(rosette_, (static_cast<double>(pulse) + 0.5) / (scan_rate_hz_ * firings_));
}

}  // namespace covsplat
