#include "covsplat/sim/simulated_lidar.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "covsplat/core/check.hpp"
#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kColumnsPerChunk = 16;

struct Return {
  Eigen::Vector3f point;  // in the sensor frame at its own time
  float intensity = 0.0f;
};

double Radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

float TimeOffset(const SimulatedLidarConfig& config, int column) {
  return static_cast<float>(((column + 0.5) / config.columns - 0.5) / config.scan_rate_hz);
}

// Chance that a return at `sine` of the angle between ray and surface is seen.
double ChanceOfReturn(const SimulatedLidarConfig& config, double sine) {
  const double grazing = Radians(config.grazing_deg);
  if (grazing <= 0.0) return 1.0;
  const double angle = std::asin(std::clamp(sine, 0.0, 1.0));
  return std::clamp(angle / grazing - 1.0, 0.0, 1.0);
}

std::optional<Return> Measure(const Scene::Hit& hit,
                              const Eigen::Vector3f& ray_world,
                              const Eigen::Vector3f& ray_sensor,
                              const SimulatedLidarConfig& config,
                              Rng rng) {
  constexpr float kHalfIntensityRange2 = 20.0f * 20.0f;
  const float sine = -hit.normal.dot(ray_world);
  const double seen = (1.0 - config.dropout_probability) * ChanceOfReturn(config, sine);
  if (rng.Uniform() >= seen) return std::nullopt;
  const double range = hit.range_m + config.range_noise_m * rng.Normal();
  if (range <= config.min_range_m || range >= config.max_range_m) return std::nullopt;
  const float fading = kHalfIntensityRange2 / (kHalfIntensityRange2 + hit.range_m * hit.range_m);
  return Return{static_cast<float>(range) * ray_sensor,
                std::clamp(hit.reflectivity * sine * fading, 0.0f, 1.0f)};
}

// The returns of one column, top first. Each ray has its own random numbers.
std::vector<Return> FireColumn(const Scene& scene,
                               const SE3& T_world_sensor,
                               const SensorModel& sensor,
                               const SimulatedLidarConfig& config,
                               int column,
                               std::uint64_t first_ray) {
  const Eigen::Matrix3d R_world_sensor = T_world_sensor.RotationMatrix();
  const Eigen::Vector3f origin = T_world_sensor.Translation().cast<float>();
  const auto reach_m = static_cast<float>(config.max_range_m);
  std::vector<Return> returns;
  returns.reserve(static_cast<std::size_t>(config.rows));
  for (int row = 0; row < config.rows; ++row) {
    const Eigen::Vector3f ray_sensor = sensor.RayOf(row, column);
    const Eigen::Vector3f ray_world = (R_world_sensor * ray_sensor.cast<double>()).cast<float>();
    const std::optional<Scene::Hit> hit = scene.Cast(origin, ray_world, reach_m);
    if (!hit) continue;
    const Rng rng(static_cast<std::uint64_t>(config.seed), first_ray + static_cast<unsigned>(row));
    const auto measured = Measure(*hit, ray_world, ray_sensor, config, rng);
    if (measured) returns.push_back(*measured);
  }
  return returns;
}

}  // namespace

SensorModel ModelOf(const SimulatedLidarConfig& config) {
  return UniformSensorModel(config.rows,
                            config.columns,
                            Radians(config.elevation_low_deg),
                            Radians(config.elevation_high_deg),
                            config.min_range_m,
                            config.max_range_m);
}

double StampOf(const SimulatedLidarConfig& config, int index) {
  return (index + 0.5) / config.scan_rate_hz;
}

Scan SimulateScan(const Scene& scene,
                  const Motion& motion,
                  const SimulatedLidarConfig& config,
                  int index,
                  ThreadPool& pool) {
  const SensorModel sensor = ModelOf(config);
  Scan scan;
  scan.index = index;
  scan.stamp_s = StampOf(config, index);
  scan.source = "simulation";
  const auto columns = static_cast<std::size_t>(config.columns);
  std::vector<std::vector<Return>> returns(columns);
  ParallelFor(pool, columns, kColumnsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      const auto column = static_cast<int>(j);
      const double time_s = scan.stamp_s + static_cast<double>(TimeOffset(config, column));
      const std::uint64_t first_ray = (static_cast<std::uint64_t>(index) * columns + j) *
                                      static_cast<std::uint64_t>(config.rows);
      returns[j] = FireColumn(scene, motion.PoseAt(time_s), sensor, config, column, first_ray);
    }
  });
  for (int column = 0; column < config.columns; ++column) {
    for (const Return& one : returns[static_cast<std::size_t>(column)]) {
      scan.points.push_back(one.point);
      scan.intensity.push_back(one.intensity);
      scan.time_offset_s.push_back(TimeOffset(config, column));
    }
  }
  return scan;
}

Scan Deskewed(const Scan& scan, const Motion& motion) {
  COVSPLAT_CHECK(scan.time_offset_s.size() == scan.points.size());
  Scan result = scan;
  result.time_offset_s.clear();
  const SE3 T_middle_world = motion.PoseAt(scan.stamp_s).Inverse();
  std::optional<float> offset_s;
  SE3 T_middle_sensor;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (offset_s != scan.time_offset_s[i]) {  // points of one column share a pose
      offset_s = scan.time_offset_s[i];
      T_middle_sensor =
          T_middle_world * motion.PoseAt(scan.stamp_s + static_cast<double>(*offset_s));
    }
    result.points[i] = (T_middle_sensor * scan.points[i].cast<double>().eval()).cast<float>();
  }
  return result;
}

}  // namespace covsplat
