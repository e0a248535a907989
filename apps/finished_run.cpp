#include "apps/finished_run.hpp"

#include <utility>

#include "apps/sensor_choice.hpp"

#include "covsplat/config/config.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

Result<void> CheckFolder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    return Fail(ErrorCode::kInput,
                "{}: is no folder; name one that `covsplat run` or `covsplat demo` wrote",
                folder.string());
  }
  for (const char* name : {"config.yaml", "trajectory_tum.txt", "keyframes_tum.txt", "map.ply"}) {
    if (fs::exists(folder / name, ignored)) continue;
    return Fail(ErrorCode::kInput,
                "{}: has no {}; name a folder that `covsplat run` wrote and finished",
                folder.string(),
                name);
  }
  return {};
}

Result<void> CheckKeyframes(const SurfelMap& map, const fs::path& folder) {
  const int count = static_cast<int>(map.T_map_keyframe.size());
  for (const int keyframe : map.keyframe) {
    if (keyframe >= 0 && keyframe < count) continue;
    return Fail(
        ErrorCode::kInput,
        "{}: a Gaussian belongs to keyframe {} but keyframes_tum.txt has {}; these files are "
        "not of one run",
        (folder / "map.ply").string(),
        keyframe,
        count);
  }
  return {};
}

}  // namespace

Result<FinishedRun> ReadRun(const fs::path& folder) {
  if (const Result<void> complete = CheckFolder(folder); !complete) return Forward(complete);
  AppConfig config;
  const Result<void> loaded = LoadYaml((folder / "config.yaml").string(), config);
  if (!loaded) return Forward(loaded);
  Result<SensorModel> sensor = SensorOf(config.slam);
  if (!sensor) {
    return Fail(
        ErrorCode::kInput, "{}: {}", (folder / "config.yaml").string(), sensor.error().message);
  }
  FinishedRun run{std::move(config), std::move(*sensor), {}, {}, 0};
  Result<Trajectory> trajectory = ReadTum(folder / "trajectory_tum.txt");
  if (!trajectory) return Forward(trajectory);
  run.trajectory = std::move(*trajectory);
  const Result<Trajectory> keyframes = ReadTum(folder / "keyframes_tum.txt");
  if (!keyframes) return Forward(keyframes);
  for (const TimedPose& pose : *keyframes) run.map.T_map_keyframe.push_back(pose.T_world_sensor);
  Result<SavedMap> saved = ReadMapPly(folder / "map.ply");
  if (!saved) return Forward(saved);
  run.map.gaussians = std::move(saved->gaussians);
  run.map.keyframe = std::move(saved->keyframe);
  if (const auto fits = CheckKeyframes(run.map, folder); !fits) return Forward(fits);
  run.map.confidence = std::move(saved->confidence);
  run.map.intensity = std::move(saved->intensity);
  run.broken = DropBroken(run.map);
  if (run.map.Size() > 0) return run;
  return Fail(ErrorCode::kInput,
              "{}: holds no Gaussians that can be drawn, so there is no surface",
              (folder / "map.ply").string());
}

}  // namespace covsplat
