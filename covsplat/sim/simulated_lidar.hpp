// A spinning LiDAR that looks at a Scene from a Motion.
#pragma once

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/scene.hpp"

namespace covsplat {

/// Defaults resemble an Ouster OS0-64.
struct SimulatedLidarConfig {
  int rows = 64;
  int columns = 1024;
  double elevation_low_deg = -45.0;
  double elevation_high_deg = 45.0;
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double scan_rate_hz = 10.0;
  double range_noise_m = 0.015;
  double dropout_probability = 0.005;
  double grazing_deg = 3.0;
  int seed = 1;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("rows", c.rows, Range{2, 512}, "beams, evenly spaced in elevation");
    v.Field("columns", c.columns, Range{16, 8192}, "firings per turn, a multiple of 4");
    v.Field("elevation_low_deg", c.elevation_low_deg, Range{-89.0, 89.0}, "lowest beam");
    v.Field("elevation_high_deg", c.elevation_high_deg, Range{-89.0, 89.0}, "highest beam");
    v.Field("min_range_m", c.min_range_m, Range{0.0, 100.0}, "nearer returns are lost");
    v.Field("max_range_m", c.max_range_m, Range{0.1, 1000.0}, "farther returns are lost");
    v.Field("scan_rate_hz", c.scan_rate_hz, Range{0.1, 100.0}, "turns per second");
    v.Field("range_noise_m", c.range_noise_m, Range{0.0, 1.0}, "standard deviation of a range");
    v.Field("dropout_probability", c.dropout_probability, Range{0.0, 1.0}, "lost at random");
    v.Field("grazing_deg",
            c.grazing_deg,
            Range{0.0, 45.0},
            "returns are lost when the ray meets the surface at less than this angle, and often up "
            "to twice as much");
    v.Field("seed", c.seed, Range{0, 1e9}, "of noise and drop-outs");
  }
};

/// The image that the simulated beams fill: one ray per pixel, through its centre.
SensorModel ModelOf(const SimulatedLidarConfig& config);

/// Stamp of a scan: the middle of its turn. The first turn starts at time 0.
double StampOf(const SimulatedLidarConfig& config, int index);

/// One turn, clockwise from the rear. Every column is measured from the pose at its own time,
/// within half a turn's time of the stamp; points are in the sensor frame at that time and in order
/// of time, columns top first. Intensity falls with range and incidence from the reflectivity,
/// within [0, 1]. The result depends on neither the pool nor other scans.
Scan SimulateScan(const Scene& scene,
                  const Motion& motion,
                  const SimulatedLidarConfig& config,
                  int index,
                  ThreadPool& pool);

/// The scan as one instant would have seen it: every point in the sensor frame at the stamp, moved
/// with the true motion. It has no time offsets.
Scan Deskewed(const Scan& scan, const Motion& motion);

}  // namespace covsplat
