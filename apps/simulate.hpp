// Recording a simulated walk.
#pragma once

#include <filesystem>

#include "apps/config_options.hpp"
#include "apps/exit_code.hpp"

#include "covsplat/sim/simulation.hpp"

namespace covsplat {

struct SimulateRequest {
  SimulationConfig config;
  std::filesystem::path folder;
  bool overwrite = false;
  bool quiet = false;
};

/// The configuration of a simulation whose section lidar starts from a preset: `sensor`, or what
/// the files and assignments name if that is empty, or the default.
Result<SimulationConfig> ResolveSimulation(const ConfigOptions& options, const std::string& sensor);

/// Writes the recording with its ground truth. A signal (see InterruptGuard, which the caller
/// holds) ends it early and leaves a shorter, whole recording.
ExitCode Simulate(const SimulateRequest& request);

/// Writes a picture of the world, seen from `share` of the way.
ExitCode Preview(const SimulationConfig& config, const std::filesystem::path& file, double share);

}  // namespace covsplat
