#include "covsplat/core/sensor_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "covsplat/core/beam_table.hpp"

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;
constexpr int kFewestColumns = 256;
constexpr double kFewestRows = 8.0;
constexpr double kMostRows = 256.0;
constexpr double kOutliers = 0.001;  // of the points, at either end
constexpr double kRangeMargin = 1.25;
constexpr double kSmallestGap_rad = 1e-5;  // less apart are returns of one pulse
constexpr double kPatch_rad = 2.0 * kDegree;
constexpr double kSteepest_rad = 89.0 * kDegree;

struct Limits {
  double low = 0.0;
  double high = 0.0;
};

// The limits of a coordinate of all points but the outliers.
Limits RobustLimits(std::span<const PolarScan> scans, double PolarPoint::*coordinate) {
  std::vector<double> values;
  for (const PolarScan& scan : scans) {
    for (const PolarPoint& point : scan) values.push_back(point.*coordinate);
  }
  return {Quantile(values, kOutliers), Quantile(values, 1.0 - kOutliers)};
}

std::size_t PointCount(std::span<const PolarScan> scans) {
  std::size_t count = 0;
  for (const PolarScan& scan : scans) count += scan.size();
  return count;
}

// The nearest allowed number of columns.
int RoundColumns(double columns, int most) {
  const int rounded = 4 * static_cast<int>(std::lround(std::min(columns, 1.0 * most) / 4.0));
  return std::clamp(rounded, std::min(kFewestColumns, most), most);
}

// Angles between neighbours of one beam in one scan.
void AppendGaps(std::vector<double> azimuths, std::vector<double>& gaps) {
  std::sort(azimuths.begin(), azimuths.end());
  for (std::size_t i = 1; i < azimuths.size(); ++i) {
    const double gap = azimuths[i] - azimuths[i - 1];
    if (gap > kSmallestGap_rad) gaps.push_back(gap);
  }
}

// As many columns as a beam measures directions in a turn, told from the usual gap between them.
int ColumnsOfBeams(std::span<const PolarScan> scans, const SensorModel& beams, int most) {
  std::vector<double> gaps;
  for (const PolarScan& scan : scans) {
    std::vector<std::vector<double>> azimuths(static_cast<std::size_t>(beams.Rows()));
    for (const PolarPoint& point : scan) {
      const double row = beams.RowOf(point.elevation_rad);
      if (row < 0.0 || row >= beams.Rows()) continue;
      azimuths[static_cast<std::size_t>(row)].push_back(point.azimuth_rad);
    }
    for (std::vector<double>& beam : azimuths) AppendGaps(std::move(beam), gaps);
  }
  return gaps.empty() ? most : RoundColumns(2.0 * kPi / Quantile(gaps, 0.5), most);
}

// Solid view, in rad of azimuth times rad of elevation, that holds any points.
double ViewArea(std::span<const PolarScan> scans) {
  std::set<std::pair<int, int>> patches;
  for (const PolarScan& scan : scans) {
    for (const PolarPoint& point : scan) {
      patches.emplace(static_cast<int>(std::floor(point.azimuth_rad / kPatch_rad)),
                      static_cast<int>(std::floor(point.elevation_rad / kPatch_rad)));
    }
  }
  return static_cast<double>(patches.size()) * kPatch_rad * kPatch_rad;
}

// Square pixels, as many in view as a scan has points.
SensorModel UniformModel(std::span<const PolarScan> scans, const Limits& range_m, int most) {
  const double scan_points =
      static_cast<double>(PointCount(scans)) / static_cast<double>(scans.size());
  const double pixel_rad = std::sqrt(ViewArea(scans) / scan_points);
  const int columns = RoundColumns(2.0 * kPi / pixel_rad, most);
  Limits elevation = RobustLimits(scans, &PolarPoint::elevation_rad);
  elevation.low = std::clamp(elevation.low, -kSteepest_rad, kSteepest_rad - kDegree);
  elevation.high = std::clamp(elevation.high, elevation.low + kDegree, kSteepest_rad);
  const double rows = std::round((elevation.high - elevation.low) * columns / (2.0 * kPi));
  return UniformSensorModel(static_cast<int>(std::clamp(rows, kFewestRows, kMostRows)),
                            columns,
                            elevation.low,
                            elevation.high,
                            range_m.low,
                            range_m.high);
}

std::string Verdict(const SensorModel& model, std::string_view rows, std::string_view how) {
  return fmt::format(
      "{} {} from {:+.1f} to {:+.1f} deg ({}), {} columns, ranges {:.1f} to {:.1f} m",
      model.Rows(),
      rows,
      model.Elevations().front() / kDegree,
      model.Elevations().back() / kDegree,
      how,
      model.Columns(),
      model.MinRange(),
      model.MaxRange());
}

SensorEstimate Assumed(int columns) {
  SensorModel model = UniformSensorModel(64, columns, -22.5 * kDegree, 22.5 * kDegree, 0.5, 100.0);
  std::string verdict = Verdict(model, "rows", "assumed: the scans have no usable points");
  return {std::move(model), RowBasis::kAssumed, std::move(verdict)};
}

}  // namespace

SensorEstimate EstimateSensorModel(std::span<const Scan> scans,
                                   const SensorEstimateOptions& options) {
  const int most = std::max(4, options.columns / 4 * 4);
  std::vector<PolarScan> polar;
  for (const Scan& scan : scans) {
    PolarScan points = ToPolar(scan);
    if (!points.empty()) polar.push_back(std::move(points));
  }
  if (polar.empty()) return Assumed(most);
  const Limits seen_m = RobustLimits(polar, &PolarPoint::range_m);
  const Limits range_m = {seen_m.low / kRangeMargin, seen_m.high * kRangeMargin};

  std::vector<double> beams = BeamsFromOrder(polar);
  const bool ordered = !beams.empty();
  if (!ordered) beams = BeamsFromElevations(polar);
  if (beams.empty()) {
    SensorModel model = UniformModel(polar, range_m, most);
    std::string verdict = Verdict(model, "even rows", "no beams found, as dense as the points");
    return {std::move(model), RowBasis::kUniform, std::move(verdict)};
  }
  const SensorModel wide(beams, most, range_m.low, range_m.high);
  const int columns = ColumnsOfBeams(polar, wide, most);
  SensorModel model(std::move(beams), columns, range_m.low, range_m.high);
  std::string verdict = Verdict(
      model, "beams", ordered ? "measured, stored one by one" : "measured, from their elevations");
  return {std::move(model), RowBasis::kBeams, std::move(verdict)};
}

}  // namespace covsplat
