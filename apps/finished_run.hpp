// FinishedRun: what `covsplat run` left in a folder, or a map file tells of its run, read back.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <optional>

#include "apps/app_config.hpp"

#include "covsplat/core/sensor_model.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/mapping/map_file.hpp"
#include "covsplat/mesh/surfel_map.hpp"

namespace covsplat {

struct FinishedRun {
  AppConfig config;                   ///< as resolved; the defaults if a map file has none
  std::optional<SensorModel> sensor;  ///< nothing if a map file does not know it
  Trajectory trajectory;              ///< map frame: of every tracked scan, or of the keyframes
  SurfelMap map;
  std::size_t broken = 0;  ///< Gaussians that were left out because they are not finite
};

/// Whether a run's folder has all of these files; the error names the first that is missing.
Result<void> CheckRunFiles(const std::filesystem::path& folder,
                           std::initializer_list<const char*> names);

/// The map of a run's folder (map.ply or, without it, map.csmap, with keyframes_tum.txt and
/// config.yaml) or of a map file. Errors name the file that is missing, damaged or does not belong
/// to the others, and what to do.
Result<MapFile> ReadRunMap(const std::filesystem::path& run_or_map);

/// The same with trajectory_tum.txt, ready to be rendered. A map without keyframes gets one, at the
/// origin. If the configuration in a map file is not one of this version, a warning is printed and
/// the defaults are used.
Result<FinishedRun> ReadRun(const std::filesystem::path& run_or_map);

/// The sensor that made the map; the error says how to get a map that knows it.
Result<SensorModel> SensorOfRun(const FinishedRun& run, const std::filesystem::path& run_or_map);

/// Where results go by default: the run's folder, or that of the map file.
std::filesystem::path FolderOfRun(const std::filesystem::path& run_or_map);

}  // namespace covsplat
