#include "covsplat/loops/sight.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace covsplat {
namespace {

constexpr int kRows = 64;
constexpr int kColumns = 128;
constexpr float kPerM = 100.0f;
constexpr float kFarthestM = 655.0f;
// Nearer than the nearest return by this is seen through: scans are some decimetres apart from each
// other and directions are coarse.
constexpr float kMarginM = 0.4f;
constexpr float kMarginShare = 0.05f;

std::optional<std::size_t> DirectionOf(const Eigen::Vector3f& point) {
  constexpr auto kPi = std::numbers::pi_v<float>;
  const float across = point.head<2>().norm();
  if (!point.allFinite() || !(point.squaredNorm() > 0.0f)) return std::nullopt;
  const float azimuth = std::atan2(point.y(), point.x()) / (2.0f * kPi) + 0.5f;
  const float elevation = std::atan2(point.z(), across) / kPi + 0.5f;
  const int column = std::min(static_cast<int>(azimuth * kColumns), kColumns - 1);
  const int row = std::min(static_cast<int>(elevation * kRows), kRows - 1);
  return static_cast<std::size_t>(row * kColumns + column);
}

}  // namespace

Sight::Sight(std::span<const Eigen::Vector3f> points)
    : nearest_cm_(static_cast<std::size_t>(kRows) * kColumns, 0) {
  for (const Eigen::Vector3f& point : points) {
    const auto direction = DirectionOf(point);
    if (!direction) continue;
    const float range_m = std::min(point.norm(), kFarthestM);
    const auto range_cm = static_cast<std::uint16_t>(std::max(1.0f, range_m * kPerM));
    std::uint16_t& nearest = nearest_cm_[*direction];
    if (nearest == 0 || range_cm < nearest) nearest = range_cm;
  }
}

Seen Sight::See(const Eigen::Vector3f& point) const {
  const auto direction = DirectionOf(point);
  if (!direction || nearest_cm_.empty() || nearest_cm_[*direction] == 0) return Seen::kUnknown;
  const float nearest_m = static_cast<float>(nearest_cm_[*direction]) / kPerM;
  const float beyond_m = nearest_m - point.norm();
  const float margin_m = kMarginM + kMarginShare * nearest_m;
  if (beyond_m > margin_m) return Seen::kThrough;
  return beyond_m >= -margin_m ? Seen::kThere : Seen::kUnknown;
}

}  // namespace covsplat
