#include "covsplat/registration/deskew.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

ScanTiming TimeByField(const Scan& scan) {
  COVSPLAT_CHECK(scan.time_offset_s.size() == scan.points.size());
  ScanTiming timing;
  timing.mid_stamp_s = scan.stamp_s;
  float first = std::numeric_limits<float>::infinity();
  float last = -first;
  for (const float offset : scan.time_offset_s) {
    if (!std::isfinite(offset)) {
      ++timing.invalid;
      continue;
    }
    first = std::min(first, offset);
    last = std::max(last, offset);
  }
  if (first > last) return timing;  // no usable time at all
  const double middle = 0.5 * (static_cast<double>(first) + last);
  timing.mid_stamp_s = scan.stamp_s + middle;
  timing.duration_s = static_cast<double>(last) - first;
  if (timing.duration_s == 0.0) return timing;
  timing.phase.reserve(scan.points.size());
  for (const float offset : scan.time_offset_s) {
    const double phase = (offset - middle) / timing.duration_s;
    timing.phase.push_back(std::isfinite(offset) ? static_cast<float>(phase) : 0.0f);
  }
  return timing;
}

ScanTiming TimeByAzimuth(const Scan& scan, const DeskewConfig& config) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  ScanTiming timing;
  timing.mid_stamp_s = scan.stamp_s;
  timing.duration_s = config.scan_period_s;
  timing.phase.reserve(scan.points.size());
  const double start = config.azimuth_start_deg * std::numbers::pi / 180.0;
  const double direction = config.azimuth_clockwise ? -1.0 : 1.0;
  for (const Eigen::Vector3f& point : scan.points) {
    if (!point.allFinite()) {
      ++timing.invalid;
      timing.phase.push_back(0.0f);
      continue;
    }
    const double azimuth = std::atan2(static_cast<double>(point.y()), point.x());
    const double turned = direction * (azimuth - start) / kTurn;
    timing.phase.push_back(static_cast<float>(turned - std::floor(turned) - 0.5));
  }
  return timing;
}

}  // namespace

ScanTiming TimeScan(const Scan& scan, const DeskewConfig& config) {
  if (config.time_source == TimeSource::kField && !scan.time_offset_s.empty()) {
    return TimeByField(scan);
  }
  if (config.time_source == TimeSource::kAzimuth) return TimeByAzimuth(scan, config);
  ScanTiming timing;
  timing.mid_stamp_s = scan.stamp_s;
  return timing;
}

}  // namespace covsplat
