// Simulation: a world, a motion through it and a LiDAR, ready to be recorded scan by scan.
#pragma once

#include <string>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/mover.hpp"
#include "covsplat/sim/scene.hpp"
#include "covsplat/sim/simulated_lidar.hpp"
#include "covsplat/sim/user_world.hpp"

namespace covsplat {

struct SimulationConfig {
  std::string world = "courtyard";
  std::string motion;
  std::string sensor;
  int laps = 1;
  int seed = 1;
  int max_scans = 0;
  UserMeshConfig mesh;
  UserRouteConfig route;
  SimulatedLidarConfig lidar;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("world", c.world, "world to move through, or the file of a mesh");
    v.Field("motion", c.motion, "how the sensor moves along the route; empty: as suits the world");
    v.Field("sensor", c.sensor, "preset that section lidar starts from; empty: os0-64");
    v.Field("laps", c.laps, Range{1, 100}, "times round a closed route");
    v.Field("seed", c.seed, Range{0, 1e9}, "of the world's details and of the walk");
    v.Field("max_scans", c.max_scans, Range{0, 1e6}, "stop after so many scans; 0: the whole walk");
    v.Section("mesh", c.mesh, "how the file of a mesh is read");
    v.Section("route", c.route, "another way than the world's own");
    v.Section("lidar", c.lidar, "the simulated sensor");
  }
};

/// Immutable; every member may be called from any thread and in any order.
class Simulation {
 public:
  /// `config.sensor` is for whoever fills `config.lidar`; it is not looked at here.
  static Result<Simulation> Create(const SimulationConfig& config);

  int ScanCount() const { return scan_count_; }
  Scan MakeScan(int index, ThreadPool& pool) const;

  /// T_world_sensor at the stamp of a scan.
  SE3 PoseOf(int index) const;
  /// Exact poses in the world frame: at every scan's stamp and at least `rate_hz` times a second,
  /// from one turn before the first measurement to one turn after the last.
  Trajectory Truth(double rate_hz) const;

  /// Of a spinning LiDAR.
  SensorModel Sensor() const { return ModelOf(config_.lidar); }
  const SimulationConfig& Config() const { return config_; }
  /// What stands still.
  const Scene& StaticWorld() const { return scene_; }
  const std::vector<Mover>& Movers() const { return movers_; }
  const Motion& SensorMotion() const { return motion_; }
  /// What looks wrong with the user's files, as sentences.
  const std::vector<std::string>& Warnings() const { return warnings_; }

 private:
  Simulation(SimulationConfig config, Scene scene, std::vector<Mover> movers, Motion motion);

  SimulationConfig config_;
  Scene scene_;
  std::vector<Mover> movers_;
  Motion motion_;
  std::vector<std::string> warnings_;
  int scan_count_ = 0;
};

}  // namespace covsplat
