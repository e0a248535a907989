// Finds the elevations of a LiDAR's beams from scans that carry no beam numbers.
#pragma once

#include <span>
#include <vector>

#include "covsplat/core/scan.hpp"

namespace covsplat {

/// Direction and distance of a measurement.
struct PolarPoint {
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
  double range_m = 0.0;
};

/// In the order in which the scan stores its points, those that are no measurement left out.
using PolarScan = std::vector<PolarPoint>;

PolarScan ToPolar(const Scan& scan);

/// For scans that store one beam after the other, as the Velodyne HDL-64E of KITTI, whose beams
/// overlap in elevation near the sensor because they leave it 0.2 m apart. Counts the turns; a beam
/// is where the farther half of its points are. Strictly decreasing, or empty if the scans are not
/// stored so.
std::vector<double> BeamsFromOrder(std::span<const PolarScan> scans);

/// For any order: the peaks of the histogram of elevations. Strictly decreasing, or empty if the
/// points do not gather in 8 to 256 peaks.
std::vector<double> BeamsFromElevations(std::span<const PolarScan> scans);

/// The value that a fraction of the values lies below; values must not be empty.
double Quantile(std::vector<double> values, double fraction);

}  // namespace covsplat
