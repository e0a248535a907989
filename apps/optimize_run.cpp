#include "apps/optimize_run.hpp"

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "apps/facts.hpp"
#include "apps/finished_run.hpp"
#include "apps/run_log.hpp"
#include "apps/slam_run.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"
#include "covsplat/loops/g2o_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

/// What a run's folder tells.
struct KnownRun {
  AppConfig config;
  fs::path recording;
  Trajectory tracked;  ///< without scans that were lost
  std::size_t keyframes = 0;
};

Result<fs::path> RecordingOf(const OptimizeRequest& request) {
  std::error_code ignored;
  if (request.recording) {
    if (fs::exists(*request.recording, ignored)) return *request.recording;
    return Fail(ErrorCode::kInput,
                "{}: does not exist; name the run's recording with --recording",
                request.recording->string());
  }
  const fs::path file = request.run / "metrics.json";
  const auto facts = RunFacts(request.run);
  if (!facts) return Forward(facts);
  if (!facts->contains("recording") || !(*facts)["recording"].is_string()) {
    return Fail(ErrorCode::kInput,
                "{}: does not say of which recording; name it with --recording",
                file.string());
  }
  const fs::path recording = (*facts)["recording"].get<std::string>();
  if (fs::exists(recording, ignored)) return recording;
  return Fail(ErrorCode::kInput,
              "{}: is of the recording {}, which is not there; name it with --recording",
              file.string(),
              recording.string());
}

/// Of the scans that a run lost, frames.csv knows the rows, and nobody the poses.
Result<Trajectory> TrackedPoses(const fs::path& run) {
  Result<Trajectory> poses = ReadTum(run / "trajectory_tum.txt");
  if (!poses) return poses;
  const Result<std::string> frames = ReadFile(run / "frames.csv");
  if (!frames) return Forward(frames);
  std::set<std::string> lost;
  std::istringstream lines(*frames);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::string scan, stamp_s, state;
    std::getline(std::getline(std::getline(cells, scan, ','), stamp_s, ','), state, ',');
    if (state == NameOf(TrackState::kLost)) lost.insert(stamp_s);
  }
  std::erase_if(*poses, [&](const TimedPose& pose) {
    return lost.contains(fmt::format("{:.9f}", pose.stamp_s));
  });
  return poses;
}

/// Each pose moved as the last keyframe up to it.
Trajectory MovedWithKeyframes(const Trajectory& tracked,
                              const Trajectory& keyframes,
                              const std::vector<SE3>& T_map_keyframe) {
  Trajectory moved;
  moved.reserve(tracked.size());
  std::size_t k = 0;
  for (const TimedPose& pose : tracked) {
    while (k + 1 < keyframes.size() && keyframes[k + 1].stamp_s <= pose.stamp_s) ++k;
    const SE3 T_keyframe_sensor = keyframes[k].T_world_sensor.Inverse() * pose.T_world_sensor;
    moved.push_back({pose.stamp_s, T_map_keyframe[k] * T_keyframe_sensor});
  }
  return moved;
}

Result<Trajectory> CorrectedBy(const fs::path& g2o,
                               const Trajectory& tracked,
                               const Trajectory& keyframes,
                               const PoseGraphConfig& solver) {
  const Result<PoseGraph> graph = ReadG2o(g2o);
  if (!graph) return Forward(graph);
  if (graph->T_map_node.size() != keyframes.size()) {
    return Fail(ErrorCode::kInput,
                "{}: has {} vertices, but the run {} keyframes; take the run's pose_graph.g2o and "
                "add edges only",
                g2o.string(),
                graph->T_map_node.size(),
                keyframes.size());
  }
  return MovedWithKeyframes(tracked, keyframes, Optimize(*graph, solver).T_map_node);
}

Result<KnownRun> ReadKnown(const OptimizeRequest& request) {
  KnownRun known;
  const Result<void> complete = CheckRunFiles(
      request.run, {"config.yaml", "trajectory_tum.txt", "keyframes_tum.txt", "frames.csv"});
  if (!complete) return Forward(complete);
  Result<Trajectory> tracked = TrackedPoses(request.run);
  if (!tracked) return Forward(tracked);
  known.tracked = std::move(*tracked);
  const Result<Trajectory> keyframes = ReadTum(request.run / "keyframes_tum.txt");
  if (!keyframes) return Forward(keyframes);
  known.keyframes = keyframes->size();
  Result<fs::path> recording = RecordingOf(request);
  if (!recording) return Forward(recording);
  known.recording = std::move(*recording);
  ConfigOptions config = request.config;
  config.files.insert(config.files.begin(), (request.run / "config.yaml").string());
  Result<AppConfig> resolved = ResolveConfig<AppConfig>(config);
  if (!resolved) return Forward(resolved);
  if (const Result<void> valid = CheckConfig(*resolved); !valid) return Forward(valid);
  known.config = std::move(*resolved);
  known.config.slam.system.schedule = Schedule::kLockstep;
  if (request.graph) {
    const PoseGraphConfig& solver = known.config.slam.loops.closer.graph;
    Result<Trajectory> corrected = CorrectedBy(*request.graph, known.tracked, *keyframes, solver);
    if (!corrected) return Forward(corrected);
    known.tracked = std::move(*corrected);
  }
  return known;
}

RunRequest RequestFor(const OptimizeRequest& request, const KnownRun& known) {
  RunRequest run;
  run.recording = known.recording;
  run.config = known.config;
  run.quiet = request.quiet;
  run.command_line = request.command_line;
  return run;
}

/// Gaussians as they are spawned are enough to stitch by.
RunRequest LoopPass(const OptimizeRequest& request,
                    const KnownRun& known,
                    const fs::path& out,
                    const fs::path& poses) {
  RunRequest run = RequestFor(request, known);
  run.folder = {out, true};
  run.poses = poses;
  run.poses_meaning = GivenPoses::kOdometry;
  run.config.slam.loops.mode = LoopMode::kOffline;
  run.config.slam.mapper.feedback.mode = FeedbackMode::kFrozen;
  return run;
}

RunRequest MapPass(const OptimizeRequest& request,
                   const KnownRun& known,
                   const fs::path& out,
                   const fs::path& poses) {
  RunRequest run = RequestFor(request, known);
  run.folder = {out, true};
  run.poses = poses;
  run.config.slam.loops.mode = LoopMode::kOff;
  constexpr std::size_t kMost = 10'000'000;
  const std::size_t steps = static_cast<std::size_t>(request.steps_per_keyframe) * known.keyframes;
  run.config.slam.mapper.schedule.final_steps = static_cast<int>(std::min(steps, kMost));
  return run;
}

}  // namespace

ExitCode OptimizeRun(const OptimizeRequest& request) {
  const Result<KnownRun> known = ReadKnown(request);
  if (!known) return ReportError(known.error());
  const auto folder = MakeRunFolder(request.folder, std::time(nullptr));
  if (!folder) return ReportError(folder.error());
  const fs::path tracked = *folder / "tracked_tum.txt";
  if (const auto written = WriteTum(tracked, known->tracked); !written) {
    return ReportError(written.error());
  }
  const fs::path first = *folder / "loops";
  if (!request.quiet) fmt::print("first pass: loops\n");
  const ExitCode code = RunSlam(LoopPass(request, *known, first, tracked));
  if (code != kExitOk) return code;
  if (!request.quiet) fmt::print("\nsecond pass: the map anew\n");
  return RunSlam(MapPass(request, *known, *folder, first / "trajectory_tum.txt"));
}

}  // namespace covsplat
