#include "covsplat/io/time_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::array<std::string_view, 8> kNames = {
    "t", "ts", "time", "timestamp", "timestamps", "time_stamp", "stamps", "offset_time"};
constexpr std::array<double, 4> kUnits_s = {1.0, 1e-3, 1e-6, 1e-9};
constexpr double kShortestScan_s = 0.02;
constexpr double kLongestScan_s = 0.5;
// Offsets from the stamp of a scan stay below this; clocks read more from their first second on.
constexpr double kLargestOffset_s = 1.0;
// Clocks that count from 1970 read 1e9 s or more since 2001.
constexpr double kEpoch_s = 1e9;

struct Limits {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

Limits LimitsOfMeasured(std::span<const double> values, std::span<const Eigen::Vector3f> points) {
  Limits limits;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i]) || !IsMeasured(points[i])) continue;
    limits.low = std::min(limits.low, values[i]);
    limits.high = std::max(limits.high, values[i]);
  }
  return limits;
}

std::optional<double> UnitOfSpan(double span) {
  for (const double unit_s : kUnits_s) {
    if (span * unit_s >= kShortestScan_s && span * unit_s <= kLongestScan_s) return unit_s;
  }
  return std::nullopt;
}

// All points have the same time: a stamp if it is a time since 1970 in some unit, else no news.
PointTimes TimesOfOneInstant(double value) {
  for (const double unit_s : kUnits_s) {
    const double stamp_s = value * unit_s;
    if (stamp_s >= kEpoch_s && stamp_s < 10.0 * kEpoch_s) return {stamp_s, {}};
  }
  return {};
}

}  // namespace

const PointColumn* FindTimeColumn(const PointTable& table) {
  for (const std::string_view name : kNames) {
    if (const PointColumn* column = table.Find(name)) return column;
  }
  return nullptr;
}

bool IsMeasured(const Eigen::Vector3f& point) { return point.allFinite() && !point.isZero(0.0f); }

Result<PointTimes> DecodePointTimes(std::span<const double> values,
                                    std::span<const Eigen::Vector3f> points,
                                    const std::string& where) {
  COVSPLAT_CHECK(values.size() == points.size());
  const Limits limits = LimitsOfMeasured(values, points);
  if (limits.low > limits.high) return PointTimes{};
  if (limits.low == limits.high) return TimesOfOneInstant(limits.low);
  const std::optional<double> unit_s = UnitOfSpan(limits.high - limits.low);
  if (!unit_s) {
    return Fail(ErrorCode::kInput,
                "{}: the times of the points run from {} to {}, a span of {}, which is a scan of "
                "{} to {} s in none of s, ms, us, ns; rename the column to ignore it",
                where,
                limits.low,
                limits.high,
                limits.high - limits.low,
                kShortestScan_s,
                kLongestScan_s);
  }
  const double largest_s = std::max(std::abs(limits.low), std::abs(limits.high)) * *unit_s;
  const bool absolute = largest_s > kLargestOffset_s;
  const double origin = absolute ? limits.low : 0.0;
  PointTimes times;
  if (absolute) times.stamp_s = limits.low * *unit_s;
  times.offset_s.reserve(values.size());
  for (const double value : values) {
    const double known = std::isnan(value) ? limits.low : value;
    const double offset = std::clamp(known, limits.low, limits.high) - origin;
    times.offset_s.push_back(static_cast<float>(offset * *unit_s));
  }
  return times;
}

}  // namespace covsplat
