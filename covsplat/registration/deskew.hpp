// When each point of a scan was measured.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/scan.hpp"

namespace covsplat {

/// Where the points' times come from.
enum class TimeSource {
  kField,    ///< `Scan::time_offset_s`; a scan without it counts as taken at once
  kAzimuth,  ///< the direction a spinning sensor was facing; the stamp is the middle of the turn
  kNone,     ///< all points were taken at once, or are deskewed already
};

template <>
struct EnumNames<TimeSource> {
  static constexpr std::array<EnumName<TimeSource>, 3> kNames = {{
      {TimeSource::kField, "field"},
      {TimeSource::kAzimuth, "azimuth"},
      {TimeSource::kNone, "none"},
  }};
};

/// What is estimated of the motion within a scan; the rest is taken from the prediction.
enum class MotionModel {
  kRigid,         ///< only the pose: 6 unknowns
  kVelocity,      ///< pose and twist: 12
  kAcceleration,  ///< pose, twist and its change within the scan: 18
};

template <>
struct EnumNames<MotionModel> {
  static constexpr std::array<EnumName<MotionModel>, 3> kNames = {{
      {MotionModel::kRigid, "none"},
      {MotionModel::kVelocity, "velocity"},
      {MotionModel::kAcceleration, "acceleration"},
  }};
};

struct DeskewConfig {
  TimeSource time_source = TimeSource::kField;
  MotionModel refine = MotionModel::kAcceleration;
  double azimuth_start_deg = 180.0;
  bool azimuth_clockwise = true;
  double scan_period_s = 0.1;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("time_source", c.time_source, "where the points' times come from");
    v.Field("refine",
            c.refine,
            "what registration estimates of the motion within a scan, to deskew it once more; "
            "none: deskewed by the velocity of the scans before alone");
    v.Field("azimuth_start_deg",
            c.azimuth_start_deg,
            Range{-360.0, 360.0},
            "azimuth: direction in which a turn begins and ends, 180 is the rear");
    v.Field("azimuth_clockwise", c.azimuth_clockwise, "azimuth: the sensor turns clockwise");
    v.Field("scan_period_s", c.scan_period_s, Range{1e-3, 10.0}, "azimuth: duration of one turn");
  }
};

/// Times of a scan's points.
struct ScanTiming {
  double mid_stamp_s = 0.0;
  double duration_s = 0.0;   ///< first to last point; 0 if all were taken at once
  std::vector<float> phase;  ///< [N] in [-0.5, 0.5], or empty: all at mid scan
  std::size_t invalid = 0;   ///< points without a usable time; their phase is 0
};

/// Never fails: points with a NaN or infinite time (or position, for azimuth) get phase 0.
ScanTiming TimeScan(const Scan& scan, const DeskewConfig& config);

}  // namespace covsplat
