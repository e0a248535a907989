// Simulation: a world, a walk through it and a LiDAR, ready to be recorded scan by scan.
#pragma once

#include <string>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/scene.hpp"
#include "covsplat/sim/simulated_lidar.hpp"

namespace covsplat {

struct SimulationConfig {
  std::string world = "courtyard";
  std::string motion = "handheld";
  int seed = 1;
  int max_scans = 0;
  SimulatedLidarConfig lidar;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("world", c.world, "world to walk through: courtyard");
    v.Field("motion", c.motion, "how the sensor moves: handheld");
    v.Field("seed", c.seed, Range{0, 1e9}, "of the world's details and of the walk");
    v.Field("max_scans", c.max_scans, Range{0, 1e6}, "stop after so many scans; 0: the whole walk");
    v.Section("lidar", c.lidar, "the simulated sensor");
  }
};

/// Immutable; every member may be called from any thread and in any order.
class Simulation {
 public:
  static Result<Simulation> Create(const SimulationConfig& config);

  int ScanCount() const { return scan_count_; }
  Scan MakeScan(int index, ThreadPool& pool) const;

  /// T_world_sensor at the stamp of a scan.
  SE3 PoseOf(int index) const;
  /// Exact poses in the world frame: at every scan's stamp and at least `rate_hz` times a second,
  /// from one turn before the first measurement to one turn after the last.
  Trajectory Truth(double rate_hz) const;

  SensorModel Sensor() const { return ModelOf(config_.lidar); }
  const SimulationConfig& Config() const { return config_; }
  const Scene& World() const { return scene_; }
  const Motion& SensorMotion() const { return motion_; }

 private:
  Simulation(SimulationConfig config, Scene scene, Motion motion);

  SimulationConfig config_;
  Scene scene_;
  Motion motion_;
  int scan_count_ = 0;
};

}  // namespace covsplat
