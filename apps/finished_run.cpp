#include "apps/finished_run.hpp"

#include <algorithm>
#include <utility>

#include "apps/exit_code.hpp"
#include "apps/sensor_choice.hpp"
#include <fmt/format.h>

#include "covsplat/config/config.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

Result<void> CheckFolder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    return Fail(ErrorCode::kInput,
                "{}: does not exist; name a folder that `covsplat run` or `covsplat demo` wrote, "
                "or a map file",
                folder.string());
  }
  return CheckRunFiles(folder, {"config.yaml", "trajectory_tum.txt", "keyframes_tum.txt"});
}

Result<AppConfig> ConfigOf(const std::string& yaml, const std::string& name) {
  AppConfig config;
  const Result<void> loaded = LoadYamlText(yaml, name, config);
  if (!loaded) return Forward(loaded);
  return config;
}

/// The one file of Gaussians in a run's folder.
Result<fs::path> MapFileIn(const fs::path& folder) {
  for (const char* name : {"map.ply", "map.csmap"}) {
    if (IsFile(folder / name)) return folder / name;
  }
  return Fail(ErrorCode::kInput,
              "{}: has no map.ply or map.csmap; name a folder that `covsplat run` wrote and "
              "finished",
              folder.string());
}

Result<void> CheckKeyframes(const SavedMap& map, const fs::path& file, std::string_view source) {
  const int count = static_cast<int>(map.keyframes.size());
  for (const int keyframe : map.keyframe) {
    if (keyframe >= 0 && keyframe < count) continue;
    return Fail(ErrorCode::kInput,
                "{}: a Gaussian belongs to keyframe {} but {} has {}; these are not of one run",
                file.string(),
                keyframe,
                source,
                count);
  }
  return {};
}

Result<MapFile> ReadMapIn(const fs::path& folder) {
  if (const Result<void> complete = CheckFolder(folder); !complete) return Forward(complete);
  const Result<fs::path> file = MapFileIn(folder);
  if (!file) return Forward(file);
  Result<Trajectory> keyframes = ReadTum(folder / "keyframes_tum.txt");
  if (!keyframes) return Forward(keyframes);
  Result<std::string> config = ReadFile(folder / "config.yaml");
  if (!config) return Forward(config);
  const Result<AppConfig> resolved = ConfigOf(*config, (folder / "config.yaml").string());
  if (!resolved) return Forward(resolved);
  Result<SensorModel> sensor = SensorOf(resolved->slam);
  if (!sensor) {
    return Fail(
        ErrorCode::kInput, "{}: {}", (folder / "config.yaml").string(), sensor.error().message);
  }
  Result<MapFile> read = ReadMapFile(*file);
  if (!read) return read;
  read->map.keyframes = std::move(*keyframes);
  read->map.sensor = std::move(*sensor);
  read->map.config_yaml = std::move(*config);
  const auto fits = CheckKeyframes(read->map, *file, "keyframes_tum.txt");
  if (!fits) return Forward(fits);
  return read;
}

/// Gaussians ride on keyframes, so a map that knows none gets one.
void EnsureKeyframes(SavedMap& map) {
  if (!map.keyframes.empty()) return;
  map.keyframes = {TimedPose()};
  std::fill(map.keyframe.begin(), map.keyframe.end(), 0);
}

SurfelMap SurfelsOf(SavedMap map) {
  SurfelMap surfels;
  surfels.gaussians = std::move(map.gaussians);
  surfels.keyframe = std::move(map.keyframe);
  surfels.confidence = std::move(map.confidence);
  surfels.intensity = std::move(map.intensity);
  for (const TimedPose& pose : map.keyframes) {
    surfels.T_map_keyframe.push_back(pose.T_world_sensor);
  }
  return surfels;
}

/// Settings of renderings. Those of another version may not be known any more.
AppConfig ConfigOrDefaults(const std::string& yaml, const fs::path& run_or_map) {
  if (yaml.empty()) return {};
  const Result<AppConfig> config = ConfigOf(yaml, "its configuration");
  if (config) return *config;
  ReportWarning(fmt::format(
      "{}: the defaults are used, because of {}", run_or_map.string(), config.error().message));
  return {};
}

}  // namespace

Result<void> CheckRunFiles(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (IsFile(folder / name)) continue;
    return Fail(ErrorCode::kInput,
                "{}: has no {}; name a folder that `covsplat run` wrote and finished",
                folder.string(),
                name);
  }
  return {};
}

Result<MapFile> ReadRunMap(const fs::path& run_or_map) {
  if (!IsFile(run_or_map)) return ReadMapIn(run_or_map);
  Result<MapFile> read = ReadMapFile(run_or_map);
  if (!read || read->map.keyframes.empty()) return read;
  const auto fits = CheckKeyframes(read->map, run_or_map, "its list of keyframes");
  if (!fits) return Forward(fits);
  return read;
}

Result<FinishedRun> ReadRun(const fs::path& run_or_map) {
  Result<MapFile> read = ReadRunMap(run_or_map);
  if (!read) return Forward(read);
  FinishedRun run;
  run.config = ConfigOrDefaults(read->map.config_yaml, run_or_map);
  run.sensor = std::move(read->map.sensor);
  run.trajectory = read->map.keyframes;
  if (!IsFile(run_or_map)) {
    Result<Trajectory> trajectory = ReadTum(run_or_map / "trajectory_tum.txt");
    if (!trajectory) return Forward(trajectory);
    run.trajectory = std::move(*trajectory);
  }
  EnsureKeyframes(read->map);
  run.map = SurfelsOf(std::move(read->map));
  run.broken = DropBroken(run.map);
  if (run.map.Size() > 0) return run;
  return Fail(ErrorCode::kInput,
              "{}: holds no Gaussians that can be drawn, so there is no surface",
              run_or_map.string());
}

Result<SensorModel> SensorOfRun(const FinishedRun& run, const fs::path& run_or_map) {
  if (run.sensor) return *run.sensor;
  return Fail(ErrorCode::kInput,
              "{}: does not say which sensor and keyframes it was made from; name the run's folder "
              "instead, or a .csmap that `covsplat export` made of it",
              run_or_map.string());
}

fs::path FolderOfRun(const fs::path& run_or_map) {
  return IsFile(run_or_map) ? run_or_map.parent_path() : run_or_map;
}

}  // namespace covsplat
