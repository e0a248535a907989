#include <algorithm>
#include <cmath>

#include "apps/facts.hpp"
#include "apps/run_truth.hpp"
#include "apps/sensor_choice.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/core/sensor_estimate.hpp"

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kLookAt = 10;

/// Of the points that are finite and not at the origin.
struct PointFacts {
  std::size_t points = 0;
  std::size_t unusable = 0;
  bool has_intensity = false;
  double time_span_s = 0.0;  ///< longest within a scan; 0: no time per point
  std::vector<float> range_m;
};

PointFacts Look(const std::vector<Scan>& scans) {
  PointFacts facts;
  for (const Scan& scan : scans) {
    facts.points += scan.points.size();
    facts.has_intensity |= !scan.intensity.empty();
    for (const Eigen::Vector3f& p : scan.points) {
      const float range = p.norm();
      if (std::isfinite(range) && range > 0.0f) {
        facts.range_m.push_back(range);
      } else {
        ++facts.unusable;
      }
    }
    if (scan.time_offset_s.empty()) continue;
    const auto [low, high] =
        std::minmax_element(scan.time_offset_s.begin(), scan.time_offset_s.end());
    facts.time_span_s = std::max(facts.time_span_s, static_cast<double>(*high) - *low);
  }
  std::sort(facts.range_m.begin(), facts.range_m.end());
  return facts;
}

double Rounded(double value) { return std::round(value * 1e4) / 1e4; }

/// First and last stamp; the last scan may be damaged, then fewer are looked at.
void AddTime(const std::filesystem::path& folder,
             const std::vector<Scan>& first,
             std::int64_t count,
             Json& facts) {
  SourceOptions options;
  options.first_scan = std::max<std::int64_t>(0, count - 1);
  const auto last = FirstScans(folder, options, 1);
  const Scan& end = last && !last->empty() ? last->front() : first.back();
  const double span_s = end.stamp_s - first.front().stamp_s;
  const auto steps = static_cast<double>(end.index - first.front().index);
  facts["first_stamp_s"] = first.front().stamp_s;
  facts["duration_s"] = Rounded(span_s);
  facts["scans_per_s"] = span_s > 0.0 ? Rounded(steps / span_s) : 0.0;
}

void AddHints(const PointFacts& points, const SensorEstimate& sensor, Json& facts) {
  std::vector<std::string> hints;
  if (points.time_span_s == 0.0 && sensor.basis == RowBasis::kBeams) {
    const double rate = facts.value("scans_per_s", 0.0);
    hints.push_back(fmt::format(
        "the points carry no times: unless the scans are deskewed already, derive them from the "
        "azimuth with -s deskew.time_source=azimuth -s deskew.scan_period_s={:.4g}",
        rate > 0.0 ? 1.0 / rate : 0.1));
  }
  if (points.time_span_s == 0.0 && sensor.basis != RowBasis::kBeams) {
    hints.push_back("the points carry no times, so scans are taken as deskewed already");
  }
  if (facts.value("ground_truth", "none") == "none") {
    hints.push_back("no ground truth lies with it; --gt gives one to evaluate against");
  }
  facts["hints"] = hints;
}

void AddPoints(const std::vector<Scan>& scans, const PointFacts& points, Json& facts) {
  facts["points_per_scan"] = points.points / scans.size();
  facts["unusable_points_percent"] =
      Rounded(100.0 * static_cast<double>(points.unusable) / static_cast<double>(points.points));
  facts["intensity"] = points.has_intensity;
  facts["point_time_span_s"] = Rounded(points.time_span_s);
  if (points.range_m.empty()) return;
  const auto at = [&](double share) {
    const auto i = static_cast<std::size_t>(share * static_cast<double>(points.range_m.size() - 1));
    return Rounded(static_cast<double>(points.range_m[i]));
  };
  facts["range_m"] = {
      {"min", at(0.0)}, {"median", at(0.5)}, {"percentile_99", at(0.99)}, {"max", at(1.0)}};
}

}  // namespace

Result<Json> RecordingFacts(const std::filesystem::path& folder) {
  const auto source = OpenScanSource(folder, {});
  if (!source) return Forward(source);
  Json facts = {{"kind", "recording"},
                {"path", folder.string()},
                {"description", (*source)->Description()},
                {"scans", (*source)->ScanCount()}};
  const auto scans = FirstScans(folder, {}, kLookAt);
  if (!scans) return Forward(scans);
  if (scans->empty()) {
    facts["hints"] = {"none of the first scans can be read or has points"};
    return facts;
  }
  AddTime(folder, *scans, (*source)->ScanCount(), facts);
  const PointFacts points = Look(*scans);
  AddPoints(*scans, points, facts);
  const SensorEstimate sensor = EstimateSensorModel(*scans, {});
  facts["sensor"] = sensor.verdict;
  const auto truth = LoadTruth(folder, std::nullopt, InputConfig().scan_period_s);
  facts["ground_truth"] = !truth   ? truth.error().message
                          : *truth ? (*truth)->path.string()
                                   : "none";
  AddHints(points, sensor, facts);
  return facts;
}

}  // namespace covsplat
