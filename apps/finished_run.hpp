// FinishedRun: what `covsplat run` left in a folder, read back.
#pragma once

#include <filesystem>

#include "apps/app_config.hpp"

#include "covsplat/core/sensor_model.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/mapping/map_file.hpp"
#include "covsplat/mesh/surfel_map.hpp"

namespace covsplat {

struct FinishedRun {
  AppConfig config;  ///< as resolved
  SensorModel sensor;
  Trajectory trajectory;  ///< one pose per tracked scan, map frame
  SurfelMap map;
  std::size_t broken = 0;  ///< Gaussians that were left out because they are not finite
};

/// Reads config.yaml, trajectory_tum.txt, keyframes_tum.txt and map.ply. Errors name the file that
/// is missing, damaged or does not belong to the others, and what to do.
Result<FinishedRun> ReadRun(const std::filesystem::path& folder);

}  // namespace covsplat
