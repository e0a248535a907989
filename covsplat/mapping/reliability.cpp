#include "covsplat/mapping/reliability.hpp"

namespace covsplat {

void FreeSpace::Remember(const Keyframe& keyframe) {
  if (!config_.enabled) return;
  sights_.push_back({keyframe.tracked.T_odom_sensor.Inverse(), keyframe.measurement.range_m});
  if (sights_.size() > static_cast<std::size_t>(config_.keyframes)) sights_.pop_front();
}

std::vector<std::uint8_t> FreeSpace::FindMoved(std::span<const Eigen::Vector3f> points,
                                               const SE3& T_odom_points,
                                               ThreadPool& pool) const {
  std::vector<int> seen(points.size(), 0);
  std::vector<int> seen_through(points.size(), 0);
  for (const Sight& sight : sights_) {
    const SE3 T_sensor_points = sight.T_sensor_odom * T_odom_points;
    const Eigen::Matrix3f rotation = T_sensor_points.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_sensor_points.Translation().cast<float>();
    ParallelFor(pool, points.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3f p = rotation * points[i] + translation;
        const std::optional<Pixel> pixel = sensor_.Project(p);
        if (!pixel) continue;
        if (Sees(sight.range_m, *pixel, p.norm())) {
          ++seen[i];
        } else if (SeesThrough(sight.range_m, *pixel, p.norm())) {
          ++seen_through[i];
        }
      }
    });
  }
  std::vector<std::uint8_t> moved(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    moved[i] = seen_through[i] >= config_.min_seen_through && seen_through[i] > seen[i];
  }
  return moved;
}

void MaskSurfaces(std::span<const std::uint8_t> masked, Keyframe& keyframe) {
  for (std::size_t i = 0; i < keyframe.surface.Size(); ++i) {
    const int surface = keyframe.surface.Pixels()[i];
    if (surface < 0 || masked[static_cast<std::size_t>(surface)] == 0) continue;
    keyframe.point.Pixels()[i] = -1;
    keyframe.surface.Pixels()[i] = -1;
    keyframe.measurement.range_m.Pixels()[i] = 0.0f;
    keyframe.measurement.normal.Pixels()[i].setZero();
  }
}

}  // namespace covsplat
