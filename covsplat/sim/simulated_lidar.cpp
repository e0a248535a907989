#include "covsplat/sim/simulated_lidar.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "covsplat/core/check.hpp"
#include "covsplat/sim/beam.hpp"
#include "covsplat/sim/scan_pattern.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kRaysPerChunk = 1024;

struct Return {
  Eigen::Vector3f point;  // in the sensor frame at its own time
  BeamReturn beam;
};

// The returns of one firing.
std::vector<Return> Fire(const WorldSnapshot& world,
                         const Eigen::Matrix3d& R_world_sensor,
                         const ScanPattern& pattern,
                         const SimulatedLidarConfig& config,
                         int scan,
                         int firing) {
  const auto rays = static_cast<std::uint64_t>(pattern.RaysPerFiring());
  const std::uint64_t first =
      (static_cast<std::uint64_t>(scan) * static_cast<std::uint64_t>(pattern.Firings()) +
       static_cast<std::uint64_t>(firing)) *
      rays;
  std::vector<Return> returns;
  returns.reserve(rays);
  for (int ray = 0; ray < pattern.RaysPerFiring(); ++ray) {
    const Eigen::Vector3f ray_sensor = pattern.Ray(scan, firing, ray);
    const Eigen::Vector3f ray_world = (R_world_sensor * ray_sensor.cast<double>()).cast<float>();
    const auto beam = SendBeam(world, ray_world, config, first + static_cast<unsigned>(ray));
    if (beam) returns.push_back({beam->range_m * ray_sensor, *beam});
  }
  return returns;
}

}  // namespace

Scan SimulateScan(const World& world,
                  const Motion& motion,
                  const SimulatedLidarConfig& config,
                  int index,
                  ThreadPool& pool) {
  const ScanPattern pattern(config);
  Scan scan;
  scan.index = index;
  scan.stamp_s = StampOf(config, index);
  scan.source = "simulation";
  const auto firings = static_cast<std::size_t>(pattern.Firings());
  const auto rays = static_cast<std::size_t>(pattern.RaysPerFiring());
  std::vector<std::vector<Return>> returns(firings);
  const std::size_t grain = std::max<std::size_t>(1, kRaysPerChunk / rays);
  ParallelFor(pool, firings, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      const auto firing = static_cast<int>(j);
      const double time_s = scan.stamp_s + static_cast<double>(pattern.TimeOffset(firing));
      const SE3 T_world_sensor = motion.PoseAt(time_s);
      const WorldSnapshot snapshot(world, time_s, T_world_sensor.Translation(), config.max_range_m);
      returns[j] = Fire(snapshot, T_world_sensor.RotationMatrix(), pattern, config, index, firing);
    }
  });
  for (std::size_t j = 0; j < firings; ++j) {
    for (const Return& one : returns[j]) {
      scan.points.push_back(one.point);
      scan.intensity.push_back(one.beam.intensity);
      scan.time_offset_s.push_back(pattern.TimeOffset(static_cast<int>(j)));
      scan.label.push_back(static_cast<std::uint32_t>(one.beam.label));
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
    if (offset_s != scan.time_offset_s[i]) {  // points of one firing share a pose
      offset_s = scan.time_offset_s[i];
      T_middle_sensor =
          T_middle_world * motion.PoseAt(scan.stamp_s + static_cast<double>(*offset_s));
    }
    result.points[i] = (T_middle_sensor * scan.points[i].cast<double>().eval()).cast<float>();
  }
  return result;
}

}  // namespace covsplat
