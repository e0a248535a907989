#include "apps/bench_run.hpp"

#include "apps/own_verb.hpp"
#include "apps/slam_run.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/io/ground_truth.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr double kPaperTauM = 0.2;

/// Calls `read` with the JSON of a file; what is missing in it is an error that names the file.
template <class Read>
Result<void> WithJson(const fs::path& file, Read&& read) {
  const Result<std::string> text = ReadFile(file);
  if (!text) return Forward(text);
  try {
    read(nlohmann::json::parse(*text));
    return {};
  } catch (const nlohmann::json::exception& error) {
    return Fail(
        ErrorCode::kInput, "{}: is not what this version writes: {}", file.string(), error.what());
  }
}

/// Writes the truth where the run and `eval map` can read it.
Result<fs::path> WriteLidarTruth(const DataSequence& sequence, const fs::path& out) {
  const Result<Trajectory> truth = LoadLidarTruth(sequence);
  if (!truth) return Forward(truth);
  std::error_code error;
  fs::create_directories(out, error);
  if (error) {
    return Fail(ErrorCode::kOutput, "{}: cannot be made: {}", out.string(), error.message());
  }
  fs::path file = out / (sequence.name + "_truth_tum.txt");
  if (const auto written = WriteTum(file, *truth); !written) return Forward(written);
  return file;
}

Result<BenchMapResult> JudgeMap(const DataSequence& sequence,
                                const fs::path& truth,
                                const fs::path& run,
                                const BenchRequest& request) {
  if (!sequence.surface) return Fail(ErrorCode::kInput, "the true surface is not there");
  const std::string mesh = (run / "mesh.ply").string();
  const int threads = request.config.slam.system.threads;
  std::vector<std::string> common = {"--quiet"};
  if (threads > 0) common.insert(common.end(), {"--threads", std::to_string(threads)});

  std::vector<std::string> words = {"mesh", run.string(), "-o", mesh};
  words.insert(words.end(), {"--voxel", fmt::format("{}", request.voxel_m)});
  words.insert(words.end(), common.begin(), common.end());
  if (const auto meshed = RunOwnVerb(words, run / "mesh.log"); !meshed) return Forward(meshed);

  words = {"eval", "map", mesh, sequence.surface->string(), "--run", run.string()};
  words.insert(words.end(), {"--recording", sequence.recording.string(), "--gt", truth.string()});
  words.insert(words.end(), {"--tau", fmt::format("{}", kPaperTauM), "--json"});
  words.insert(words.end(), common.begin(), common.end());
  const fs::path found = run / "map_metrics.json";
  if (const auto judged = RunOwnVerb(words, found); !judged) return Forward(judged);
  return ReadBenchMapResult(found);
}

RunRequest RunRequestOf(const DataSequence& sequence,
                        const fs::path& truth,
                        const BenchRequest& request) {
  RunRequest run;
  run.recording = sequence.recording;
  run.title = sequence.name;
  run.folder.out = request.out / sequence.name;
  run.folder.overwrite = request.overwrite;
  run.config = request.config;
  run.max_scans = request.max_scans;
  run.quiet = request.quiet;
  run.truth = truth;
  run.command_line = request.command_line;
  return run;
}

}  // namespace

Result<Trajectory> LoadLidarTruth(const DataSequence& sequence) {
  if (sequence.truth_of_camera) return ReadOdometryTruth(sequence.truth, sequence.recording);
  Result<Trajectory> truth = LoadTrajectory(sequence.truth, {});
  if (!truth) return truth;
  for (TimedPose& pose : *truth) pose.T_world_sensor = pose.T_world_sensor * sequence.T_truth_lidar;
  return truth;
}

Result<BenchResult> ReadBenchResult(const fs::path& run) {
  BenchResult result;
  const Result<void> read = WithJson(run / "metrics.json", [&](const nlohmann::json& metrics) {
    const nlohmann::json& time = metrics.at("time");
    const double seconds = time.at("feed_s").get<double>() + time.at("finish_s").get<double>();
    const auto scans = metrics.at("scans").at("tracked").get<double>();
    if (seconds > 0.0) result.scans_per_s = scans / seconds;
    result.gaussians = metrics.at("map").at("gaussians").get<std::int64_t>();
    result.map_mb = 1e-6 * metrics.at("map").at("file_bytes").get<double>();
    const nlohmann::json& error = metrics.at("trajectory_error");
    if (!error.is_null())
      result.ate_rmse_m = error.at("ate_translation_m").at("rmse").get<double>();
  });
  if (!read) return Forward(read);
  return result;
}

Result<BenchMapResult> ReadBenchMapResult(const fs::path& file) {
  BenchMapResult map;
  const Result<void> read = WithJson(file, [&](const nlohmann::json& found) {
    const nlohmann::json& paper = found.at("paper");
    map.accuracy_cm = paper.at("accuracy_cm").get<double>();
    map.completeness_cm = paper.at("completeness_cm").get<double>();
    map.chamfer_l1_cm = paper.at("chamfer_l1_cm").get<double>();
    map.f_score_percent = paper.at("scores").at(0).at("f_score_percent").get<double>();
  });
  if (!read) return Forward(read);
  return map;
}

BenchResult BenchSequence(const DataSequence& sequence, const BenchRequest& request) {
  BenchResult result;
  result.sequence = sequence.name;
  const auto truth = WriteLidarTruth(sequence, request.out);
  if (!truth) {
    result.exit_code = ReportError(truth.error());
    return result;
  }
  const RunRequest run = RunRequestOf(sequence, *truth, request);
  const ExitCode code = RunSlam(run);
  Result<BenchResult> read = ReadBenchResult(*run.folder.out);
  if (code != kExitOk || !read) {
    result.exit_code = code != kExitOk ? code : ReportError(read.error());
    return result;
  }
  result = std::move(*read);
  result.sequence = sequence.name;
  result.first_scans = request.max_scans;
  if (!request.map) return result;
  const Result<BenchMapResult> map = JudgeMap(sequence, *truth, *run.folder.out, request);
  if (map) {
    result.map = *map;
  } else {
    result.map_note = map.error().message;
    if (sequence.surface) result.map_exit_code = ExitCodeOf(map.error().code);
  }
  return result;
}

}  // namespace covsplat
