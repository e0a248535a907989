// What a simulated LiDAR can be told.
#pragma once

#include <array>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/core/sensor_presets.hpp"

namespace covsplat {

enum class LidarKind {
  kSpinning,  ///< rows of beams that turn clockwise from the rear
  kRosette,   ///< one beam behind two turning prisms
};

template <>
struct EnumNames<LidarKind> {
  static constexpr std::array<EnumName<LidarKind>, 2> kNames = {
      {{LidarKind::kSpinning, "spinning"}, {LidarKind::kRosette, "rosette"}}};
};

/// Defaults resemble an Ouster OS0-64.
struct SimulatedLidarConfig {
  LidarKind kind = LidarKind::kSpinning;
  int rows = 64;
  int columns = 1024;
  double elevation_low_deg = -45.0;
  double elevation_high_deg = 45.0;
  std::vector<double> elevation_deg = {};
  RosettePattern rosette = {};
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double scan_rate_hz = 10.0;
  double range_noise_m = 0.015;
  double range_noise_per_m = 0.0;
  double dropout_probability = 0.005;
  double grazing_deg = 3.0;
  double beam_divergence_mrad = 6.1;
  double mixed_pixel_probability = 0.5;
  double pulse_length_m = 0.75;
  int seed = 1;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("kind", c.kind, "how the beams sweep");
    v.Field("rows", c.rows, Range{2, 512}, "spinning: beams");
    v.Field("columns", c.columns, Range{16, 8192}, "spinning: firings per turn, a multiple of 4");
    v.Field("elevation_low_deg", c.elevation_low_deg, Range{-89.0, 89.0}, "lowest of even beams");
    v.Field("elevation_high_deg", c.elevation_high_deg, Range{-89.0, 89.0}, "highest");
    v.Field("elevation_deg",
            c.elevation_deg,
            Range{-89.0, 89.0},
            "spinning, uneven beams: all `rows` of them, top first; empty: even beams");
    v.Section("rosette", c.rosette, "the pattern of kind rosette");
    v.Field("min_range_m", c.min_range_m, Range{0.0, 100.0}, "nearer returns are lost");
    v.Field("max_range_m", c.max_range_m, Range{0.1, 1000.0}, "farther returns are lost");
    v.Field("scan_rate_hz", c.scan_rate_hz, Range{0.1, 100.0}, "scans (turns) per second");
    v.Field("range_noise_m", c.range_noise_m, Range{0.0, 1.0}, "standard deviation of a range");
    v.Field("range_noise_per_m",
            c.range_noise_per_m,
            Range{0.0, 0.1},
            "more of it per metre of range, added in squares");
    v.Field("dropout_probability", c.dropout_probability, Range{0.0, 1.0}, "lost at random");
    v.Field("grazing_deg",
            c.grazing_deg,
            Range{0.0, 45.0},
            "returns are lost when the ray meets the surface at less than this angle, and often up "
            "to twice as much");
    v.Field("beam_divergence_mrad",
            c.beam_divergence_mrad,
            Range{0.0, 50.0},
            "full width of a beam, whose edge may meet another surface than its middle");
    v.Field("mixed_pixel_probability",
            c.mixed_pixel_probability,
            Range{0.0, 1.0},
            "chance that such a return lies between the two surfaces; 0: no mixed pixels");
    v.Field("pulse_length_m",
            c.pulse_length_m,
            Range{0.0, 10.0},
            "surfaces farther apart than this never mix");
    v.Field("seed", c.seed, Range{0, 1e9}, "of noise and drop-outs");
  }
};

/// The configuration that simulates a known sensor.
SimulatedLidarConfig LidarConfigOf(const SensorPreset& preset);

/// Whether a LiDAR can be built so; the error names the field.
Result<void> CheckLidar(const SimulatedLidarConfig& config);

/// The image that the beams of a spinning LiDAR fill: one ray per pixel, through its centre.
SensorModel ModelOf(const SimulatedLidarConfig& config);

/// Stamp of a scan: the middle of its time. The first scan starts at time 0.
double StampOf(const SimulatedLidarConfig& config, int index);

}  // namespace covsplat
