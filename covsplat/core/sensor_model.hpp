// SensorModel: the spherical image of one LiDAR. It alone knows where a ray falls in the image, and
// the azimuth wrap lives here.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace covsplat {

struct Pixel {
  int row = 0;
  int column = 0;
};

/// Columns divide the full turn evenly, clockwise from the rear: azimuth +pi is the left edge, the
/// sensor's x axis the middle, and column 0 neighbours the last one. Rows follow the beams, top
/// first, evenly spaced or not. Pixel (i, j) covers [i, i+1) x [j, j+1); its ray passes through its
/// centre (i + 0.5, j + 0.5), and the ideal return of beam i falls exactly there.
class SensorModel {
 public:
  /// Continuous row coordinate as a function of elevation: linear between samples at
  /// `origin_rad + k / samples_per_rad`. Rows beyond the outer beams continue at their spacing.
  struct RowTable {
    double origin_rad = 0.0;
    double samples_per_rad = 0.0;
    std::vector<float> row;
  };

  /// `elevation_rad`: one per row, strictly decreasing, at least two, within +-pi/2. `columns`: a
  /// positive multiple of 4 (the rasteriser's tile width).
  SensorModel(std::vector<double> elevation_rad,
              int columns,
              double min_range_m,
              double max_range_m);

  int Rows() const { return static_cast<int>(elevation_rad_.size()); }
  int Columns() const { return columns_; }
  double MinRange() const { return min_range_m_; }
  double MaxRange() const { return max_range_m_; }
  const std::vector<double>& Elevations() const { return elevation_rad_; }
  const RowTable& Table() const { return table_; }

  /// Continuous column of an azimuth in [-pi, pi], in [0, columns).
  double ColumnOf(double azimuth_rad) const;
  /// Continuous row of an elevation; outside [0, rows) if the beams do not reach it.
  double RowOf(double elevation_rad) const;
  double ColumnAzimuth(int column) const;

  /// The pixel a point in the sensor frame falls on, or nothing if it is out of view. Range limits
  /// are not applied here.
  std::optional<Pixel> Project(const Eigen::Vector3f& point) const;
  /// Unit ray through the centre of a pixel.
  Eigen::Vector3f RayOf(int row, int column) const;

 private:
  std::vector<double> elevation_rad_;
  int columns_;
  double min_range_m_;
  double max_range_m_;
  RowTable table_;
};

/// `rows` beams evenly spaced over [low, high], both included; the usual model of an Ouster.
SensorModel UniformSensorModel(int rows,
                               int columns,
                               double elevation_low_rad,
                               double elevation_high_rad,
                               double min_range_m,
                               double max_range_m);

}  // namespace covsplat
