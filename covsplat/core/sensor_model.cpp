#include "covsplat/core/sensor_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
// Fine enough (0.044 deg) to be exact for even beams and within 0.02 rows for measured tables.
constexpr int kRowTableSize = 4097;

double ExactRow(const std::vector<double>& elevation_rad, double elevation) {
  // First beam at or below the elevation; the segment is extended at both ends.
  const auto below = std::lower_bound(
      elevation_rad.begin() + 1, elevation_rad.end() - 1, elevation, std::greater<>());
  const double upper = *(below - 1);
  const double lower = *below;
  const double beam = static_cast<double>(below - elevation_rad.begin() - 1);
  return beam + 0.5 + (upper - elevation) / (upper - lower);
}

SensorModel::RowTable MakeRowTable(const std::vector<double>& elevation_rad) {
  SensorModel::RowTable table;
  table.origin_rad = -0.5 * kPi;
  table.samples_per_rad = (kRowTableSize - 1) / kPi;
  table.row.reserve(kRowTableSize);
  for (int k = 0; k < kRowTableSize; ++k) {
    const double elevation = table.origin_rad + k / table.samples_per_rad;
    table.row.push_back(static_cast<float>(ExactRow(elevation_rad, elevation)));
  }
  return table;
}

}  // namespace

SensorModel::SensorModel(std::vector<double> elevation_rad,
                         int columns,
                         double min_range_m,
                         double max_range_m)
    : elevation_rad_(std::move(elevation_rad)),
      columns_(columns),
      min_range_m_(min_range_m),
      max_range_m_(max_range_m) {
  COVSPLAT_CHECK(elevation_rad_.size() >= 2);
  COVSPLAT_CHECK(std::adjacent_find(elevation_rad_.begin(),
                                    elevation_rad_.end(),
                                    std::less_equal<>()) == elevation_rad_.end());
  COVSPLAT_CHECK(elevation_rad_.front() < 0.5 * kPi && elevation_rad_.back() > -0.5 * kPi);
  COVSPLAT_CHECK(columns_ > 0 && columns_ % 4 == 0);
  table_ = MakeRowTable(elevation_rad_);
}

double SensorModel::ColumnOf(double azimuth_rad) const {
  const double column = columns_ * (0.5 - azimuth_rad / (2.0 * kPi));
  return column >= columns_ ? column - columns_ : std::max(column, 0.0);
}

double SensorModel::RowOf(double elevation_rad) const {
  const double position = (elevation_rad - table_.origin_rad) * table_.samples_per_rad;
  const double clamped = std::clamp(position, 0.0, kRowTableSize - 1.000001);
  const auto index = static_cast<std::size_t>(clamped);
  const double fraction = clamped - static_cast<double>(index);
  return table_.row[index] + fraction * (table_.row[index + 1] - table_.row[index]);
}

double SensorModel::ColumnAzimuth(int column) const {
  return kPi - (column + 0.5) * 2.0 * kPi / columns_;
}

std::optional<Pixel> SensorModel::Project(const Eigen::Vector3f& point) const {
  const double x = point.x();
  const double y = point.y();
  const double horizontal = std::sqrt(x * x + y * y);
  const double row = RowOf(std::atan2(static_cast<double>(point.z()), horizontal));
  if (!(row >= 0.0 && row < Rows())) return std::nullopt;
  const auto column = static_cast<int>(ColumnOf(std::atan2(y, x)));
  return Pixel{static_cast<int>(row), std::min(column, columns_ - 1)};
}

Eigen::Vector3f SensorModel::RayOf(int row, int column) const {
  const double azimuth = ColumnAzimuth(column);
  const double elevation = elevation_rad_[static_cast<std::size_t>(row)];
  return Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                         std::sin(azimuth) * std::cos(elevation),
                         std::sin(elevation))
      .cast<float>();
}

SensorModel UniformSensorModel(int rows,
                               int columns,
                               double elevation_low_rad,
                               double elevation_high_rad,
                               double min_range_m,
                               double max_range_m) {
  std::vector<double> elevation_rad(static_cast<std::size_t>(rows));
  for (int i = 0; i < rows; ++i) {
    elevation_rad[static_cast<std::size_t>(i)] =
        elevation_high_rad + (elevation_low_rad - elevation_high_rad) * i / (rows - 1);
  }
  return {std::move(elevation_rad), columns, min_range_m, max_range_m};
}

}  // namespace covsplat
