#include "covsplat/sim/lidar_config.hpp"

#include <algorithm>
#include <functional>
#include <numbers>
#include <utility>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

double Radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

Result<void> CheckBeams(const SimulatedLidarConfig& config) {
  if (config.columns <= 0 || config.columns % 4 != 0) {
    return Fail(
        ErrorCode::kUsage, "lidar.columns is {}; choose a positive multiple of 4", config.columns);
  }
  const std::vector<double>& table = config.elevation_deg;
  if (table.empty()) {
    if (config.elevation_low_deg < config.elevation_high_deg) return {};
    return Fail(ErrorCode::kUsage,
                "lidar.elevation_low_deg ({}) must be below lidar.elevation_high_deg ({})",
                config.elevation_low_deg,
                config.elevation_high_deg);
  }
  if (static_cast<int>(table.size()) != config.rows) {
    return Fail(ErrorCode::kUsage,
                "lidar.rows is {}, but lidar.elevation_deg has {} beams; set both or, for even "
                "beams, lidar.elevation_deg=[]",
                config.rows,
                table.size());
  }
  if (std::adjacent_find(table.begin(), table.end(), std::less_equal<>()) != table.end()) {
    return Fail(ErrorCode::kUsage,
                "lidar.elevation_deg must name the top beam first, each lower than the one before");
  }
  return {};
}

}  // namespace

SimulatedLidarConfig LidarConfigOf(const SensorPreset& preset) {
  SimulatedLidarConfig config;
  if (preset.rosette) {
    config.kind = LidarKind::kRosette;
    config.rosette = *preset.rosette;
  } else {
    config.rows = static_cast<int>(preset.elevation_deg.size());
    config.columns = preset.columns;
    config.elevation_high_deg = preset.elevation_deg.front();
    config.elevation_low_deg = preset.elevation_deg.back();
    if (preset.even.rows == 0) config.elevation_deg = preset.elevation_deg;
  }
  config.scan_rate_hz = preset.scan_rate_hz;
  config.min_range_m = preset.min_range_m;
  config.max_range_m = preset.max_range_m;
  config.range_noise_m = preset.range_noise_m;
  config.range_noise_per_m = preset.range_noise_per_m;
  config.beam_divergence_mrad = preset.beam_divergence_mrad;
  return config;
}

Result<void> CheckLidar(const SimulatedLidarConfig& config) {
  if (config.min_range_m >= config.max_range_m) {
    return Fail(ErrorCode::kUsage,
                "lidar.min_range_m ({}) must be below lidar.max_range_m ({})",
                config.min_range_m,
                config.max_range_m);
  }
  if (config.kind == LidarKind::kSpinning) return CheckBeams(config);
  if (config.rosette.points_per_s < config.scan_rate_hz) {
    return Fail(ErrorCode::kUsage,
                "lidar.rosette.points_per_s ({}) is less than one point per scan",
                config.rosette.points_per_s);
  }
  return {};
}

SensorModel ModelOf(const SimulatedLidarConfig& config) {
  COVSPLAT_CHECK(config.kind == LidarKind::kSpinning);
  if (config.elevation_deg.empty()) {
    return UniformSensorModel(config.rows,
                              config.columns,
                              Radians(config.elevation_low_deg),
                              Radians(config.elevation_high_deg),
                              config.min_range_m,
                              config.max_range_m);
  }
  std::vector<double> elevation_rad;
  for (const double e : config.elevation_deg) elevation_rad.push_back(Radians(e));
  return {std::move(elevation_rad), config.columns, config.min_range_m, config.max_range_m};
}

double StampOf(const SimulatedLidarConfig& config, int index) {
  return (index + 0.5) / config.scan_rate_hz;
}

}  // namespace covsplat
