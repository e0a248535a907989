// From a scan to the points that registration works with, each with its local surface.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/registration/deskew.hpp"
#include "covsplat/registration/motion.hpp"

namespace covsplat {

struct PreprocessConfig {
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double downsample_voxel_m = 0.4;
  int min_points = 3000;
  int max_points = 6000;
  int covariance_neighbours = 25;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("min_range_m", c.min_range_m, Range{0.0, 100.0}, "drop points nearer than this");
    v.Field("max_range_m", c.max_range_m, Range{1.0, 1000.0}, "drop points farther than this");
    v.Field("downsample_voxel_m",
            c.downsample_voxel_m,
            Range{0.02, 10.0},
            "keep one point for each cube of this size");
    v.Field("min_points",
            c.min_points,
            Range{0, 1000000},
            "halve these cubes, twice at most, while fewer points would be left");
    v.Field("max_points",
            c.max_points,
            Range{100, 1000000},
            "of more points, evenly many are left out of registration");
    v.Field("covariance_neighbours",
            c.covariance_neighbours,
            Range{4, 200},
            "measurements a local covariance needs; the neighbourhood widens until it has them");
  }
};

/// The surface around a point: eigen-decomposition of the covariance of its neighbourhood.
struct PointCovariance {
  /// R_sensor_surface, a proper rotation: columns r0, r1 in the surface along descending variance,
  /// r2 the normal, which faces the sensor: <r2, p> < 0.
  Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();
  Eigen::Vector3f sigma_m = Eigen::Vector3f::Zero();  ///< standard deviations, descending
};

/// A downsampled scan. Points and axes are in the sensor's frame at the point's own time, as
/// measured: nothing is deskewed, so the motion can still be estimated.
struct SourceCloud {
  double duration_s = 0.0;                  ///< of the scan; 0 if all points were taken at once
  std::vector<Eigen::Vector3f> points;      ///< [N] m; measured points, not centroids
  std::vector<float> phase;                 ///< [N] in [-0.5, 0.5]; 0 if all were taken at once
  std::vector<int> scan_index;              ///< [N] which point of the scan it is
  std::vector<PointCovariance> covariance;  ///< [N]

  std::size_t scan_points = 0;   ///< of the scan, usable or not
  std::size_t not_finite = 0;    ///< dropped: NaN or infinite coordinates
  std::size_t out_of_range = 0;  ///< dropped: outside the range limits

  std::size_t Size() const { return points.size(); }
};

/// Keeps one measured point per voxel, the one nearest to the voxel's centre, in order of the first
/// measurement in each voxel, and of these at most `max_points`. Covariances come from *all*
/// measurements around it, brought together with the predicted motion. `predicted.T_map_sensor` is
/// not used.
SourceCloud Preprocess(const Scan& scan,
                       const ScanTiming& timing,
                       const ScanMotion& predicted,
                       const PreprocessConfig& config,
                       ThreadPool& pool);

}  // namespace covsplat
