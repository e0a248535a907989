#include "apps/sensor_choice.hpp"

#include <algorithm>
#include <numbers>

#include "covsplat/core/sensor_estimate.hpp"

namespace covsplat {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

bool IsComplete(const SensorConfig& sensor) {
  return !sensor.elevation_deg.empty() && sensor.columns > 0;
}

/// Where the first scans were taken says little about how near or far later returns will be, so the
/// estimated ranges are for people only.
void FillRanges(SlamConfig& config) {
  SensorConfig& sensor = config.sensor;
  if (sensor.min_range_m == 0.0) sensor.min_range_m = config.tracker.preprocess.min_range_m;
  if (sensor.max_range_m == 0.0) sensor.max_range_m = config.tracker.preprocess.max_range_m;
}

void FillFrom(const SensorModel& model, SlamConfig& config) {
  SensorConfig& sensor = config.sensor;
  if (sensor.elevation_deg.empty()) {
    for (const double e : model.Elevations()) sensor.elevation_deg.push_back(e / kDegree);
  }
  if (sensor.columns == 0) sensor.columns = model.Columns();
}

}  // namespace

Result<SensorModel> SensorOf(const SlamConfig& config) {
  const SensorConfig& sensor = config.sensor;
  const std::vector<double>& table = sensor.elevation_deg;
  if (table.size() < 2 ||
      std::adjacent_find(table.begin(), table.end(), std::less_equal<>()) != table.end()) {
    return Fail(ErrorCode::kUsage,
                "sensor.elevation_deg needs two or more elevations, the top beam first, each lower "
                "than the one before");
  }
  if (sensor.columns < 4 || sensor.columns % 4 != 0) {
    return Fail(
        ErrorCode::kUsage, "sensor.columns is {}; choose a positive multiple of 4", sensor.columns);
  }
  if (sensor.min_range_m >= sensor.max_range_m) {
    return Fail(ErrorCode::kUsage,
                "sensor.min_range_m ({}) must be below sensor.max_range_m ({})",
                sensor.min_range_m,
                sensor.max_range_m);
  }
  std::vector<double> elevation_rad;
  for (const double e : table) elevation_rad.push_back(e * kDegree);
  return SensorModel(
      std::move(elevation_rad), sensor.columns, sensor.min_range_m, sensor.max_range_m);
}

Result<std::vector<Scan>> FirstScans(const std::filesystem::path& recording,
                                     SourceOptions source,
                                     int count) {
  const Result<std::unique_ptr<ScanSource>> opened = OpenScanSource(recording, source);
  if (!opened) return Forward(opened);
  constexpr std::int64_t kLookAt = 100;
  const std::int64_t most = std::min(kLookAt + count, (*opened)->ScanCount());
  std::vector<Scan> scans;
  for (std::int64_t i = 0; i < most && static_cast<int>(scans.size()) < count; ++i) {
    Result<std::optional<Scan>> scan = (*opened)->Next();
    if (!scan) continue;  // the run itself will report it
    if (!*scan) break;
    if (!(*scan)->points.empty()) scans.push_back(std::move(**scan));
  }
  return scans;
}

Result<SensorChoice> ChooseSensor(const std::filesystem::path& recording,
                                  SourceOptions source,
                                  SlamConfig& config) {
  std::string verdict = "as configured";
  if (!IsComplete(config.sensor)) {
    const auto scans = FirstScans(recording, source, config.sensor.estimate_scans);
    if (!scans) return Forward(scans);
    const int columns =
        config.sensor.columns > 0 ? config.sensor.columns : config.sensor.max_columns;
    SensorEstimate estimate = EstimateSensorModel(*scans, {.columns = columns});
    FillFrom(estimate.model, config);
    verdict = std::move(estimate.verdict);
  }
  FillRanges(config);
  Result<SensorModel> model = SensorOf(config);
  if (!model) return Forward(model);
  return SensorChoice{std::move(*model), std::move(verdict)};
}

}  // namespace covsplat
