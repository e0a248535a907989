// Sensors by name: what their data sheets say about beams, rate, reach and noise.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/core/sensor_model.hpp"

namespace covsplat {

/// Beams that are `rows` even steps from `high_deg` down to `low_deg`.
struct EvenBeams {
  int rows = 0;
  double low_deg = 0.0;
  double high_deg = 0.0;
};

/// One beam behind two turning prisms, as in a Livox: it draws a rosette that does not repeat from
/// scan to scan and fills a cone about the x axis.
struct RosettePattern {
  double half_angle_deg = 0.0;
  double points_per_s = 0.0;
  double fast_prism_hz = 0.0;
  double slow_prism_hz = 0.0;  ///< negative: against the fast one
};

struct SensorPreset {
  std::string_view name;
  std::string_view description;
  EvenBeams even;                     ///< rows 0 if the beams are not even
  std::vector<double> elevation_deg;  ///< all beams, top first; empty if it is no spinning sensor
  int columns = 0;                    ///< firings per turn at `scan_rate_hz`, a multiple of 4
  std::optional<RosettePattern> rosette;
  double scan_rate_hz = 10.0;
  double min_range_m = 0.0;
  double max_range_m = 0.0;
  double range_noise_m = 0.0;         ///< standard deviation near the sensor
  double range_noise_per_m = 0.0;     ///< what grows with the range
  double beam_divergence_mrad = 0.0;  ///< full width
};

/// Every sensor that is known, in the order in which lists show them.
std::span<const SensorPreset> SensorPresets();

/// The error names the known ones.
Result<SensorPreset> FindSensorPreset(std::string_view name);

/// The range image of a spinning sensor; an error for one without rows, such as a Livox.
Result<SensorModel> SensorModelOf(const SensorPreset& preset);

}  // namespace covsplat
