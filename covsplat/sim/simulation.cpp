#include "covsplat/sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/sim/worlds.hpp"

namespace covsplat {

Result<Simulation> Simulation::Create(const SimulationConfig& config) {
  if (config.lidar.columns <= 0 || config.lidar.columns % 4 != 0) {
    return Fail(ErrorCode::kUsage,
                "lidar.columns is {}; choose a positive multiple of 4",
                config.lidar.columns);
  }
  if (config.lidar.elevation_low_deg >= config.lidar.elevation_high_deg) {
    return Fail(ErrorCode::kUsage,
                "lidar.elevation_low_deg ({}) must be below lidar.elevation_high_deg ({})",
                config.lidar.elevation_low_deg,
                config.lidar.elevation_high_deg);
  }
  Result<WorldMesh> mesh = MakeWorld(config.world, config.seed);
  if (!mesh) return Forward(mesh);
  Result<Motion> motion = MakeMotion(config.world, config.motion, config.seed);
  if (!motion) return Forward(motion);
  return Simulation(config, Scene(std::move(*mesh)), std::move(*motion));
}

Simulation::Simulation(SimulationConfig config, Scene scene, Motion motion)
    : config_(std::move(config)), scene_(std::move(scene)), motion_(std::move(motion)) {
  scan_count_ = static_cast<int>(motion_.Duration() * config_.lidar.scan_rate_hz);
  if (config_.max_scans > 0) scan_count_ = std::min(scan_count_, config_.max_scans);
}

Scan Simulation::MakeScan(int index, ThreadPool& pool) const {
  COVSPLAT_CHECK(index >= 0 && index < scan_count_);
  return SimulateScan(scene_, motion_, config_.lidar, index, pool);
}

SE3 Simulation::PoseOf(int index) const { return motion_.PoseAt(StampOf(config_.lidar, index)); }

Trajectory Simulation::Truth(double rate_hz) const {
  const SimulatedLidarConfig& lidar = config_.lidar;
  const double turn_s = 1.0 / lidar.scan_rate_hz;
  const auto samples = static_cast<int>(std::ceil((scan_count_ + 2) * turn_s * rate_hz));
  std::vector<double> stamps;
  for (int i = 0; i < scan_count_; ++i) stamps.push_back(StampOf(lidar, i));
  for (int i = 0; i <= samples; ++i) {
    // A sample that is a scan's stamp but for rounding becomes it.
    constexpr double kSameTimeS = 1e-7;
    const double sample_s = i / rate_hz - turn_s;
    const double nearest_s =
        StampOf(lidar, static_cast<int>(std::floor(sample_s * lidar.scan_rate_hz)));
    stamps.push_back(std::abs(sample_s - nearest_s) < kSameTimeS ? nearest_s : sample_s);
  }
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  Trajectory truth;
  truth.reserve(stamps.size());
  for (const double stamp_s : stamps) truth.push_back({stamp_s, motion_.PoseAt(stamp_s)});
  return truth;
}

}  // namespace covsplat
