#include "covsplat/core/sensor_presets.hpp"

#include <numbers>
#include <string>
#include <utility>

namespace covsplat {
namespace {

std::vector<double> Steps(const EvenBeams& beams) {
  std::vector<double> elevation_deg;
  for (int i = 0; i < beams.rows; ++i) {
    elevation_deg.push_back(beams.high_deg +
                            (beams.low_deg - beams.high_deg) * i / (beams.rows - 1));
  }
  return elevation_deg;
}

SensorPreset Even(std::string_view name,
                  std::string_view description,
                  const EvenBeams& beams,
                  int columns) {
  SensorPreset preset;
  preset.name = name;
  preset.description = description;
  preset.even = beams;
  preset.elevation_deg = Steps(beams);
  preset.columns = columns;
  return preset;
}

SensorPreset WithRange(SensorPreset preset, double min_range_m, double max_range_m) {
  preset.min_range_m = min_range_m;
  preset.max_range_m = max_range_m;
  return preset;
}

SensorPreset WithBeam(SensorPreset preset,
                      double range_noise_m,
                      double range_noise_per_m,
                      double beam_divergence_mrad) {
  preset.range_noise_m = range_noise_m;
  preset.range_noise_per_m = range_noise_per_m;
  preset.beam_divergence_mrad = beam_divergence_mrad;
  return preset;
}

// Two blocks of 32 lasers: the upper one in thirds of a degree, the lower one in halves.
SensorPreset Hdl64e() {
  SensorPreset preset;
  preset.name = "hdl-64e";
  preset.description = "Velodyne HDL-64E: 64 uneven beams, 2 to -24.33 deg";
  constexpr int kLasersPerBlock = 32;
  for (int i = 0; i < kLasersPerBlock; ++i) preset.elevation_deg.push_back(2.0 - i / 3.0);
  for (int i = 0; i < kLasersPerBlock; ++i) {
    preset.elevation_deg.push_back(-8.0 - 5.0 / 6.0 - i / 2.0);
  }
  preset.columns = 2084;  // 0.1728 deg at 10 Hz
  return WithBeam(WithRange(std::move(preset), 0.9, 120.0), 0.015, 0.0001, 2.0);
}

// The cone and the rate of a Mid-70; its prisms turn about as those of a Mid-40 were measured to
// (Brazeal et al., Sensors 21(14), 2021).
SensorPreset LivoxMid70() {
  SensorPreset preset;
  preset.name = "livox-mid70";
  preset.description = "Livox Mid-70: a cone of 70.4 deg, 100,000 points/s, never the same twice";
  preset.rosette = RosettePattern{35.2, 100000.0, 7294.0 / 60.0, -4664.0 / 60.0};
  return WithBeam(WithRange(std::move(preset), 0.1, 200.0), 0.015, 0.0002, 2.7);
}

std::vector<SensorPreset> MakePresets() {
  std::vector<SensorPreset> presets;
  const auto add = [&](SensorPreset preset) { presets.push_back(std::move(preset)); };
  add(WithBeam(
      WithRange(Even("os0-64", "Ouster OS0-64: 90 deg", {64, -45.0, 45.0}, 1024), 0.5, 100.0),
      0.015,
      0.0,
      6.1));
  add(WithBeam(
      WithRange(Even("os0-128", "Ouster OS0-128: 90 deg", {128, -45.0, 45.0}, 1024), 0.3, 50.0),
      0.01,
      0.0006,
      6.1));
  add(WithBeam(
      WithRange(Even("os1-64", "Ouster OS1-64: 45 deg", {64, -22.5, 22.5}, 1024), 0.3, 120.0),
      0.008,
      0.0004,
      3.1));
  add(WithBeam(
      WithRange(Even("os1-128", "Ouster OS1-128: 45 deg", {128, -22.5, 22.5}, 1024), 0.3, 120.0),
      0.008,
      0.0004,
      3.1));
  add(WithBeam(
      WithRange(Even("vlp-16", "Velodyne VLP-16: 30 deg", {16, -15.0, 15.0}, 1808), 0.5, 100.0),
      0.012,
      0.0001,
      3.0));
  add(Hdl64e());
  add(WithBeam(
      WithRange(
          Even("pandar-xt32", "Hesai Pandar XT-32: 31 deg", {32, -16.0, 15.0}, 2000), 0.05, 120.0),
      0.005,
      0.0001,
      1.5));
  add(LivoxMid70());
  return presets;
}

}  // namespace

std::span<const SensorPreset> SensorPresets() {
  static const std::vector<SensorPreset> presets = MakePresets();
  return presets;
}

Result<SensorPreset> FindSensorPreset(std::string_view name) {
  std::string known;
  for (const SensorPreset& preset : SensorPresets()) {
    if (preset.name == name) return preset;
    known += known.empty() ? "" : ", ";
    known += preset.name;
  }
  return Fail(ErrorCode::kUsage, "unknown sensor '{}'; known: {}", name, known);
}

Result<SensorModel> SensorModelOf(const SensorPreset& preset) {
  if (preset.elevation_deg.empty()) {
    return Fail(ErrorCode::kUsage,
                "the sensor '{}' does not spin and has no rows; choose another",
                preset.name);
  }
  std::vector<double> elevation_rad;
  for (const double e : preset.elevation_deg) {
    elevation_rad.push_back(e * std::numbers::pi / 180.0);
  }
  return SensorModel(
      std::move(elevation_rad), preset.columns, preset.min_range_m, preset.max_range_m);
}

}  // namespace covsplat
