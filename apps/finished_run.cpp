#include "apps/finished_run.hpp"

#include <algorithm>
#include <utility>

#include "apps/sensor_choice.hpp"

#include "covsplat/config/config.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

/// Whether each row of frames.csv is a keyframe.
Result<std::vector<bool>> ReadKeyframeFlags(const fs::path& path) {
  const Result<std::string> text = ReadFile(path);
  if (!text) return Forward(text);
  const auto split = [](std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find(',', begin), line.size());
      words.push_back(line.substr(begin, end - begin));
      begin = end + 1;
    }
    return words;
  };
  LineReader lines(*text);
  lines.Next();
  const std::vector<std::string_view> names = split(lines.Line());
  const auto column =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "keyframe") - names.begin());
  if (column == names.size()) {
    return Fail(ErrorCode::kInput,
                "{}: has no column \"keyframe\": not what `covsplat run` writes",
                path.string());
  }
  std::vector<bool> flags;
  while (lines.NextWithContent()) {
    const std::vector<std::string_view> words = split(lines.Line());
    if (words.size() != names.size() || (words[column] != "0" && words[column] != "1")) {
      return Fail(ErrorCode::kInput,
                  "{}:{}: is damaged; if the run was killed, run the recording again",
                  path.string(),
                  lines.Number());
    }
    flags.push_back(words[column] == "1");
  }
  return flags;
}

Result<void> CheckFolder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    return Fail(ErrorCode::kInput,
                "{}: is no folder; name one that `covsplat run` or `covsplat demo` wrote",
                folder.string());
  }
  for (const char* name : {"config.yaml", "trajectory_tum.txt", "frames.csv", "map.ply"}) {
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
    return Fail(ErrorCode::kInput,
                "{}: a Gaussian belongs to keyframe {} but frames.csv has {}; these files are not "
                "of one run",
                (folder / "map.ply").string(),
                keyframe,
                count);
  }
  return {};
}

Result<std::vector<SE3>> ReadKeyframes(const fs::path& folder, const Trajectory& trajectory) {
  const Result<std::vector<bool>> is_keyframe = ReadKeyframeFlags(folder / "frames.csv");
  if (!is_keyframe) return Forward(is_keyframe);
  if (is_keyframe->size() != trajectory.size()) {
    return Fail(ErrorCode::kInput,
                "{}: frames.csv has {} scans and trajectory_tum.txt {}; these files are not of one "
                "run",
                folder.string(),
                is_keyframe->size(),
                trajectory.size());
  }
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    // The first scan starts the map; its row is written before that is known.
    if (i == 0 || (*is_keyframe)[i]) poses.push_back(trajectory[i].T_world_sensor);
  }
  if (poses.empty()) {
    return Fail(ErrorCode::kInput,
                "{}: has no scans, so there is no map",
                (folder / "frames.csv").string());
  }
  return poses;
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
  Result<std::vector<SE3>> keyframes = ReadKeyframes(folder, run.trajectory);
  if (!keyframes) return Forward(keyframes);
  run.map.T_map_keyframe = std::move(*keyframes);
  Result<SavedMap> saved = ReadMapPly(folder / "map.ply");
  if (!saved) return Forward(saved);
  run.map.gaussians = std::move(saved->gaussians);
  run.map.keyframe = std::move(saved->keyframe);
  if (const auto fits = CheckKeyframes(run.map, folder); !fits) return Forward(fits);
  run.map.confidence = std::move(saved->confidence);
  run.broken = DropBroken(run.map);
  if (run.map.Size() > 0) return run;
  return Fail(ErrorCode::kInput,
              "{}: holds no Gaussians that can be drawn, so there is no surface",
              (folder / "map.ply").string());
}

}  // namespace covsplat
