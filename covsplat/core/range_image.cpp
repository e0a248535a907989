#include "covsplat/core/range_image.hpp"

namespace covsplat {

RangeImage ProjectScan(const SensorModel& sensor, std::span<const Eigen::Vector3f> points) {
  RangeImage image{Image<float>(sensor.Rows(), sensor.Columns(), 0.0f),
                   Image<int>(sensor.Rows(), sensor.Columns(), -1)};
  const auto min_range = static_cast<float>(sensor.MinRange());
  const auto max_range = static_cast<float>(sensor.MaxRange());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float range = points[i].norm();
    if (!(range > min_range && range < max_range)) continue;  // NaN fails both
    const std::optional<Pixel> pixel = sensor.Project(points[i]);
    if (!pixel) continue;
    float& nearest = image.range_m(pixel->row, pixel->column);
    if (nearest > 0.0f && nearest <= range) continue;
    nearest = range;
    image.point_index(pixel->row, pixel->column) = static_cast<int>(i);
  }
  return image;
}

}  // namespace covsplat
