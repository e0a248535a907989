#include "apps/run_report.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "apps/run_log.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>

#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kMaxEvents = 60;
constexpr std::size_t kMaxHeldOutPictures = 4;
constexpr double kMaxTruthGapS = 0.5;

ReportSummary SummaryOf(const RunResults& results) {
  const MemoryUse memory = ReadMemoryUse();
  ReportSummary summary;
  summary.scans = static_cast<std::int64_t>(results.records.size());
  summary.lost_scans = LostScans(results);
  summary.late_scans = results.feed.late;
  summary.dropped_scans = results.feed.dropped;
  summary.keyframes = static_cast<std::int64_t>(results.keyframes);
  summary.path_length_m = PathLengthOf(results);
  summary.scans_per_s = ScansPerSecond(results);
  summary.wall_s = results.feed_s + results.finish_s;
  summary.gaussians = static_cast<std::int64_t>(results.gaussians);
  summary.map_bytes = results.map_bytes;
  summary.final_rss_bytes = static_cast<double>(memory.rss_bytes);
  summary.peak_rss_bytes = static_cast<double>(memory.peak_rss_bytes);
  if (results.error) summary.ate_rmse_m = results.error->ate_translation_m.rmse;
  return summary;
}

void AddTrajectory(const SlamSystem& system, const RunResults& results, ReportData& data) {
  for (const ScanRecord& r : results.records) {
    data.trajectory_m.push_back(r.T_map_sensor.Translation());
  }
  for (const std::int64_t scan : system.KeyframeScans()) {
    data.keyframes.push_back(RecordOf(results, scan));
  }
}

/// Where loops were looked for and found; the rest is in loops.csv.
void AddLoops(const SlamSystem& system, const RunResults& results, ReportData& data) {
  if (system.Loops() == nullptr) return;
  for (const LoopRecord& loop : system.Loops()->Loops()) {
    std::vector<std::size_t>& marks =
        loop.check.fate == LoopFate::kAccepted ? data.loops_closed : data.loops_rejected;
    for (const int keyframe : {loop.old_keyframe, loop.new_keyframe}) {
      marks.push_back(
          RecordOf(results, system.KeyframeScans()[static_cast<std::size_t>(keyframe)]));
    }
  }
}

/// How many loops had which fate.
std::string FatesOf(const LoopCloser& loops) {
  std::string text;
  for (const auto& [fate, name] : EnumNames<LoopFate>::kNames) {
    const std::int64_t count = loops.Count(fate);
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, name);
  }
  return text.empty() ? "no place was seen again" : text;
}

/// Truth in the map frame, and how far the estimate is from it along the path.
void AddTruth(const RunResults& results, ReportData& data) {
  if (!results.error) return;
  const SE3 T_map_truth = results.error->T_truth_estimate.Inverse();
  double path_m = 0.0;
  for (std::size_t i = 0; i < results.records.size(); ++i) {
    const ScanRecord& record = results.records[i];
    const Eigen::Vector3d here = record.T_map_sensor.Translation();
    if (i > 0) path_m += (here - results.records[i - 1].T_map_sensor.Translation()).norm();
    const auto truth = PoseAt(results.truth->trajectory, record.stamp_s, kMaxTruthGapS);
    if (!truth) continue;
    data.truth_m.push_back(T_map_truth * truth->Translation());
    data.drift_path_m.push_back(path_m);
    data.drift_m.push_back((data.truth_m.back() - here).norm());
  }
}

void AddHeldOut(const RunResults& results, ReportData& data) {
  const std::size_t count = results.held_out.size();
  const std::size_t stride = std::max<std::size_t>(1, count / kMaxHeldOutPictures);
  std::size_t pictures = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const HeldOutResult& result = results.held_out[i];
    HeldOutScan scan;
    scan.scan = result.scan;
    if (result.before.pixels > 0) scan.before_m = result.before.mean_abs_m;
    if (result.after.pixels > 0) scan.after_m = result.after.mean_abs_m;
    if (i % stride == stride / 2 && pictures++ < kMaxHeldOutPictures) {
      scan.measured_m = result.measured_m;
      scan.rendered_m = result.rendered_m;
    }
    data.held_out.push_back(std::move(scan));
  }
}

void AddCurves(const RunResults& results, ReportData& data) {
  StageTimes seen;
  for (const ScanRecord& record : results.records) {
    for (const auto& [stage, ms] : record.times.Stages()) seen.Add(stage, ms);
    data.gaussians.push_back(static_cast<double>(record.gaussians));
  }
  for (const auto& [stage, total] : seen.Stages()) {
    StackLayer layer{std::string(stage), {}};
    for (const ScanRecord& record : results.records) layer.values.push_back(record.times.Of(stage));
    data.stage_ms.push_back(std::move(layer));
  }
  for (const ScanCost& cost : results.costs) {
    data.rss_bytes.push_back(static_cast<double>(cost.rss_bytes));
    data.latency_ms.push_back(cost.latency_ms);
  }
  for (const KeyframeTraining& keyframe : results.training) {
    data.keyframe_steps.push_back(static_cast<double>(keyframe.steps));
  }
}

/// Runs of lost scans, degenerate ones, and what the recording did wrong, in order.
void AddEvents(const RunResults& results, ReportData& data) {
  using Level = ReportEvent::Level;
  std::vector<ReportEvent> events;
  bool lost = false, weak = false;
  for (const ScanRecord& r : results.records) {
    if (!lost && r.state == TrackState::kLost) {
      events.push_back(
          {Level::kWarning,
           r.scan,
           fmt::format("track lost: {:.0f} % of the scan lie on the map", 100.0 * r.inlier_ratio)});
    }
    if (lost && r.state == TrackState::kTracking) {
      events.push_back({Level::kInfo, r.scan, "track found again"});
    }
    if (!weak && r.degenerate_directions > 0) {
      events.push_back({Level::kInfo,
                        r.scan,
                        fmt::format("{} direction(s) of motion can hardly be seen from here",
                                    r.degenerate_directions)});
    }
    lost = r.state == TrackState::kLost;
    weak = r.degenerate_directions > 0;
  }
  for (const FeedProblem& p : results.problems) events.push_back({Level::kWarning, p.scan, p.text});
  if (results.interrupted) events.push_back({Level::kWarning, -1, "interrupted by a signal"});
  if (events.size() > kMaxEvents) {
    const std::size_t more = events.size() - kMaxEvents;
    events.resize(kMaxEvents);
    events.push_back({Level::kWarning, -1, fmt::format("... and {} more events", more)});
  }
  data.events = std::move(events);
}

std::string TodayAsText() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[32] = "";
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M", &local);
  return text;
}

std::string SpreadOf(const HeldOutErrors& errors) {
  return fmt::format("median {}, 90 % below {}, 95 % below {}",
                     FormatMetres(errors.median_abs_m),
                     FormatMetres(errors.p90_abs_m),
                     FormatMetres(errors.p95_abs_m));
}

void AddDetails(const SlamSystem& system, const RunResults& results, ReportData& data) {
  const double keyframes = std::max<double>(1.0, static_cast<double>(results.keyframes));
  data.details = {{"sensor", results.sensor_verdict},
                  {"machine", MachineName()},
                  {"threads", fmt::format("{}, {}", results.threads, results.schedule)},
                  {"backend", results.backend},
                  {"optimiser steps",
                   fmt::format("{} ({:.0f} per keyframe)",
                               FormatCount(static_cast<double>(results.mapper_steps)),
                               static_cast<double>(results.mapper_steps) / keyframes)},
                  {"latency", LatencyText(results)},
                  {"memory of the map",
                   fmt::format("Gaussians {}, training views {}, places {}",
                               FormatBytes(static_cast<double>(results.map_memory.gaussians_bytes)),
                               FormatBytes(static_cast<double>(results.map_memory.views_bytes)),
                               FormatBytes(static_cast<double>(results.map_memory.places_bytes)))}};
  std::string mapper;
  for (const auto& [stage, ms] : results.mapper_times.Stages()) {
    mapper += fmt::format("{}{} {}", mapper.empty() ? "" : ", ", stage, FormatSeconds(ms * 1e-3));
  }
  if (!mapper.empty()) data.details.emplace_back("mapper thread", mapper);
  const FeedCounts& feed = results.feed;
  if (feed.damaged + feed.backwards + results.without_pose > 0) {
    data.details.emplace_back("scans left out",
                              fmt::format("{} damaged, {} out of order, {} without a given pose",
                                          feed.damaged,
                                          feed.backwards,
                                          results.without_pose));
  }
  if (system.Loops() != nullptr) data.details.emplace_back("loops", FatesOf(*system.Loops()));
  if (const auto means = MeansOf(results.held_out)) {
    data.details.emplace_back(
        "held-out coverage",
        fmt::format("{:.1f} % of the measured pixels as spawned, {:.1f} % optimised",
                    100.0 * means->before.coverage,
                    100.0 * means->after.coverage));
    data.details.emplace_back(
        "held-out depth error",
        fmt::format(
            "{} as spawned; {} optimised", SpreadOf(means->before), SpreadOf(means->after)));
  }
  if (results.truth) data.details.emplace_back("ground truth", results.truth->path.string());
}

}  // namespace

ReportData ReportOf(const SlamSystem& system,
                    const std::string& config_yaml,
                    const RunResults& results) {
  ReportData data;
  data.title = results.title;
  data.subtitle = fmt::format("{}, {}", results.source, TodayAsText());
  data.summary = SummaryOf(results);
  AddTrajectory(system, results, data);
  AddLoops(system, results, data);
  AddTruth(results, data);
  for (const MapPicture& p : results.pictures) data.map_pictures.push_back({p.caption, p.image});
  AddHeldOut(results, data);
  AddCurves(results, data);
  AddEvents(results, data);
  data.config_yaml = config_yaml;
  data.version = COVSPLAT_VERSION;
  data.command_line = results.command_line;
  data.input = fmt::format("{}: {}", results.recording.string(), results.source);
  AddDetails(system, results, data);
  return data;
}

}  // namespace covsplat
