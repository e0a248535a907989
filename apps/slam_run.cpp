#include "apps/slam_run.hpp"

#include <chrono>
#include <utility>

#include "apps/interrupt.hpp"
#include "apps/loop_log.hpp"
#include "apps/progress.hpp"
#include "apps/run_conclusion.hpp"
#include "apps/run_log.hpp"
#include "apps/run_truth.hpp"
#include "apps/sensor_choice.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>

#include "covsplat/config/config.hpp"
#include "covsplat/core/enum_name.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kMaxWarnings = 10;

SourceOptions SourceOf(const RunRequest& request) {
  SourceOptions options;
  options.format = request.config.input.format;
  options.first_scan = request.first_scan;
  if (request.max_scans >= 0) options.max_scans = request.max_scans * request.jump;
  options.kitti_elevation_correction_deg = request.config.input.kitti_elevation_correction_deg;
  options.scan_period_s = request.config.input.scan_period_s;
  return options;
}

/// What a run needs before its first scan.
struct Prepared {
  std::unique_ptr<ScanFeed> feed;
  std::int64_t scans = 0;
  std::unique_ptr<SlamSystem> system;
  std::filesystem::path folder;
  RunResults results;
};

Result<Prepared> Prepare(RunRequest& request) {
  Prepared run;
  const SourceOptions options = SourceOf(request);
  auto source = OpenScanSource(request.recording, options);
  if (!source) return Forward(source);
  run.results.source = (*source)->Description();
  run.scans = ((*source)->ScanCount() + request.jump - 1) / request.jump;
  run.feed = MakeFeed(std::move(*source), request.jump, Interrupted);
  run.feed = MakeReadAheadFeed(std::move(run.feed), Interrupted);
  if (request.realtime_rate > 0.0) {
    run.feed = MakeRealtimeFeed(std::move(run.feed), request.realtime_rate, Interrupted);
  }

  auto truth = LoadTruth(request.recording, request.truth, request.config.input.scan_period_s);
  if (!truth) return Forward(truth);
  run.results.truth = std::move(*truth);
  const auto sensor = ChooseSensor(request.recording, options, request.config.slam);
  if (!sensor) return Forward(sensor);
  run.results.sensor_verdict = sensor->verdict;
  auto system = SlamSystem::Create(request.config.slam, sensor->model);
  if (!system) return Forward(system);
  run.system = std::move(*system);
  if (request.poses) {
    const double period_s = request.config.input.scan_period_s;
    Result<Trajectory> poses = LoadForRecording(*request.poses, request.recording, period_s);
    if (!poses) return Forward(poses);
    run.system->UsePoses(std::move(*poses), request.poses_meaning);
  }
  const auto folder = MakeRunFolder(request.folder, std::time(nullptr));
  if (!folder) return Forward(folder);
  run.folder = *folder;
  return run;
}

/// The last part of a path that has one.
std::string NameOf(const std::filesystem::path& folder) {
  const std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

void DescribeRun(const RunRequest& request, const SlamSystem& running, RunResults& results) {
  const SystemConfig& system = request.config.slam.system;
  results.recording = request.recording;
  results.title = request.title.empty() ? NameOf(request.recording) : request.title;
  results.command_line = request.command_line;
  results.threads = system.threads > 0 ? system.threads : CpuCount();
  results.schedule = NameOfEnum(system.schedule);
  results.backend = running.GetMapper().Map().Engine().Device();
}

/// Prints the first problems and keeps all.
void NoteProblems(ScanFeed& feed, Progress& progress, RunResults& results) {
  for (FeedProblem& problem : feed.TakeProblems()) {
    const std::size_t seen = results.problems.size();
    if (seen < kMaxWarnings) progress.Message("covsplat: warning: " + problem.text);
    if (seen == kMaxWarnings) {
      progress.Message("covsplat: warning: further scans are left out; the report counts them");
    }
    results.problems.push_back(std::move(problem));
  }
}

ProgressStatus StatusOf(const Prepared& run, std::int64_t fed, std::int64_t lost) {
  ProgressStatus status;
  const ScanRecord& record = run.results.records.back();
  status.done = fed;
  status.total = run.scans;
  status.ms_per_scan = record.track_ms;
  status.gaussians = static_cast<std::int64_t>(record.gaussians);
  status.rss_bytes = run.results.costs.back().rss_bytes;
  status.lost = lost;
  return status;
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool IsComplete(const Prepared& run) {
  return !run.results.interrupted && run.results.without_pose == 0;
}

/// Scan by scan until there are no more, a signal comes, or the disk is full.
Result<void> FeedScans(Prepared& run, RunLog& log, Progress& progress) {
  std::int64_t fed = 0;
  std::int64_t lost = 0;
  while (!Interrupted()) {
    const std::optional<FedScan> scan = run.feed->Next();
    NoteProblems(*run.feed, progress, run.results);
    if (!scan) break;
    ++fed;
    const double waited_ms = 1e3 * SecondsSince(scan->arrival);
    const std::optional<ScanRecord> record = run.system->Process(scan->scan);
    if (!record) {
      ++run.results.without_pose;
      continue;
    }
    lost += record->state == TrackState::kLost;
    const std::int64_t rss_bytes = ReadMemoryUse().rss_bytes;
    const ScanCost cost = {waited_ms + record->track_ms, rss_bytes};
    if (const Result<void> written = log.Append(*record, cost); !written) return written;
    run.results.records.push_back(*record);
    run.results.costs.push_back(cost);
    progress.Update(StatusOf(run, fed, lost));
  }
  run.results.feed = run.feed->Counts();
  run.results.interrupted = Interrupted();
  const Result<void> filled = IsComplete(run) ? log.FillTo(run.scans) : Result<void>();
  return filled.and_then([&] { return log.Close(); });
}

/// What loops made of the scans' poses, and how they came about.
Result<void> TakeLoops(Prepared& run, const ScanSelection& scans) {
  const LoopCloser* loops = run.system->Loops();
  if (loops == nullptr) return {};
  run.results.loops = {loops->Count(LoopFate::kAccepted),
                       static_cast<std::int64_t>(loops->Loops().size())};
  for (ScanRecord& record : run.results.records) {
    record.T_map_sensor = run.system->PoseOf(record.scan);
  }
  const std::int64_t count = IsComplete(run) ? run.scans : 0;
  return WriteLoops(run.folder, *loops, run.system->KeyframeScans()).and_then([&] {
    return RewritePoses(run.folder, scans, run.results.records, count);
  });
}

Result<void> Track(Prepared& run, const RunRequest& request) {
  const ScanSelection scans = {request.first_scan, request.jump};
  Result<RunLog> log = RunLog::Open(run.folder, scans);
  if (!log) return Forward(log);
  Progress::Options options;
  options.quiet = request.quiet;
  Progress progress(options);
  const auto start = std::chrono::steady_clock::now();
  if (const Result<void> fed = FeedScans(run, *log, progress); !fed) return fed;
  run.results.feed_s = SecondsSince(start);
  const auto end = std::chrono::steady_clock::now();
  run.system->Finish();
  run.results.finish_s = SecondsSince(end);
  return TakeLoops(run, scans);
}

Result<void> CheckUsable(const RunResults& results) {
  if (results.interrupted || results.gaussians > 0) return {};
  const std::string folder = results.recording.string();
  if (results.without_pose > 0 && results.records.empty()) {
    return Fail(ErrorCode::kInput, "{}: no scan has a pose at its time", folder);
  }
  if (results.records.empty()) {
    return Fail(ErrorCode::kInput, "{}: not one scan could be used", folder);
  }
  return Fail(ErrorCode::kInput,
              "{}: none of the {} scans has points to make a map of; see "
              "preprocess.min_range_m and max_range_m",
              folder,
              results.records.size());
}

}  // namespace

ExitCode RunSlam(const RunRequest& original) {
  RunRequest request = original;
  Result<Prepared> run = Prepare(request);
  if (!run) return ReportError(run.error());
  DescribeRun(request, *run->system, run->results);
  const std::string config_yaml = DumpYaml(request.config);
  if (!request.quiet) {
    fmt::print("recording   {}: {}\nsensor      {}\nbackend     {}\n",
               request.recording.string(),
               run->results.source,
               run->results.sensor_verdict,
               run->results.backend);
    std::fflush(stdout);
  }
  const Result<void> saved = WriteFileAtomically(run->folder / "config.yaml", config_yaml);
  if (!saved) return ReportError(saved.error());
  if (const auto tracked = Track(*run, request); !tracked) {
    return ReportError(tracked.error());
  }
  const Result<void> concluded =
      ConcludeRun(*run->system, request.config, config_yaml, run->folder, run->results);
  if (!concluded) return ReportError(concluded.error());
  if (const auto usable = CheckUsable(run->results); !usable) return ReportError(usable.error());
  if (!request.quiet) {
    fmt::print(
        "{}report      {}\n", SummaryText(run->results), (run->folder / "report.html").string());
  }
  return run->results.interrupted ? kExitInterrupted : kExitOk;
}

}  // namespace covsplat
