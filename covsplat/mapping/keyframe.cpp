#include "covsplat/mapping/keyframe.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "covsplat/mapping/signals.hpp"
#include "covsplat/registration/nearest_index.hpp"

namespace covsplat {
namespace {

/// So far beyond a place, and so much of its range more, a measurement has seen through it.
constexpr float kBeyondM = 0.3f;
constexpr float kBeyondRatio = 0.03f;
/// Where a measurement agrees with a range to this much, it shows what is there.
constexpr float kSeenToleranceM = 0.1f;
constexpr float kSeenToleranceRatio = 0.02f;
/// Cosine of the flattest incidence at which a surface tells where rays beside the measured one
/// meet it.
constexpr float kMinIncidence = 0.1f;

/// Where a pixel's ray meets the surface that was measured in the pixel, but not in its middle. Of
/// several measurements in a pixel the nearest is left: taken as it is, it would draw slanted
/// surfaces towards the sensor.
float RangeAlong(const Eigen::Vector3f& ray,
                 const Eigen::Vector3f& point,
                 const Eigen::Vector3f& normal) {
  const float range_m = point.norm();
  const float distance_m = normal.dot(point);
  const float cosine = normal.dot(ray);
  const bool is_flat =
      std::abs(cosine) < kMinIncidence || std::abs(distance_m) < kMinIncidence * range_m;
  return is_flat ? range_m : distance_m / cosine;
}

}  // namespace

double Overlap(std::span<const float> squared_distance, double overlap_distance_m) {
  if (squared_distance.empty()) return 0.0;
  const auto limit = static_cast<float>(overlap_distance_m * overlap_distance_m);
  const auto near = std::count_if(
      squared_distance.begin(), squared_distance.end(), [&](float d2) { return d2 < limit; });
  return static_cast<double>(near) / static_cast<double>(squared_distance.size());
}

Keyframe MakeKeyframe(TrackedScan tracked,
                      const SensorModel& sensor,
                      double max_surface_distance_m,
                      ThreadPool& pool) {
  RangeImage image = ProjectScan(sensor, tracked.points);
  Keyframe keyframe{
      std::move(tracked),
      {std::move(image.range_m),
       Image<Eigen::Vector3f>(sensor.Rows(), sensor.Columns(), Eigen::Vector3f::Zero())},
      std::move(image.point_index),
      Image<int>(sensor.Rows(), sensor.Columns(), -1),
      {}};
  const TrackedScan& scan = keyframe.tracked;
  keyframe.control_score = ControlScores(scan.covariance, scan.squared_distance);
  const NearestIndex index(scan.surface, static_cast<float>(max_surface_distance_m));
  const auto gate = static_cast<float>(max_surface_distance_m * max_surface_distance_m);
  ParallelFor(pool, keyframe.point.Size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const int point = keyframe.point.Pixels()[i];
      if (point < 0) continue;
      const Eigen::Vector3f& p = scan.points[static_cast<std::size_t>(point)];
      const NearestIndex::Match match = index.Nearest(p, gate);
      if (match.slot < 0) continue;
      const int surface = index.IndexOf(match.slot);
      keyframe.surface.Pixels()[i] = surface;
      const auto& axes = scan.covariance[static_cast<std::size_t>(surface)].axes;
      const Eigen::Vector3f normal = axes.col(2);
      keyframe.measurement.normal.Pixels()[i] = normal.dot(p) < 0.0f ? normal : -normal;
      const auto pixel = static_cast<int>(i);
      const Eigen::Vector3f ray = sensor.RayOf(pixel / sensor.Columns(), pixel % sensor.Columns());
      keyframe.measurement.range_m.Pixels()[i] = RangeAlong(ray, p, normal);
    }
  });
  return keyframe;
}

bool Sees(const Image<float>& measured_m, Pixel pixel, float range_m) {
  const float measured = measured_m(pixel.row, pixel.column);
  const float tolerance_m = kSeenToleranceM + kSeenToleranceRatio * measured;
  return measured > 0.0f && std::abs(measured - range_m) < tolerance_m;
}

bool LiesOnSurface(const RangeMeasurement& measurement,
                   const SensorModel& sensor,
                   Pixel pixel,
                   const Eigen::Vector3f& point,
                   float distance_m) {
  const float range_m = measurement.range_m(pixel.row, pixel.column);
  const Eigen::Vector3f& normal = measurement.normal(pixel.row, pixel.column);
  if (!(range_m > 0.0f) || normal.isZero()) return false;
  const Eigen::Vector3f surface = range_m * sensor.RayOf(pixel.row, pixel.column);
  return std::abs(normal.dot(point - surface)) < distance_m;
}

bool SeesThrough(const Image<float>& measured_m, Pixel pixel, float range_m) {
  const float beyond_m = kBeyondM + (1.0f + kBeyondRatio) * range_m;
  const int last_row = std::min(pixel.row + 1, measured_m.Rows() - 1);
  bool measures = false;
  for (int row = std::max(pixel.row - 1, 0); row <= last_row; ++row) {
    for (int k = -1; k <= 1; ++k) {
      const int column = (pixel.column + k + measured_m.Columns()) % measured_m.Columns();
      if (measured_m(row, column) <= 0.0f) continue;
      if (measured_m(row, column) < beyond_m) return false;
      measures = true;
    }
  }
  return measures;
}

}  // namespace covsplat
