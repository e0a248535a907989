#include "apps/run_results.hpp"

#include <algorithm>

#include "apps/error_json.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/core/percentile.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;

void AddScaled(const HeldOutErrors& errors, double weight, HeldOutErrors& sum) {
  sum.pixels += errors.pixels;
  sum.mean_abs_m += weight * errors.mean_abs_m;
  sum.median_abs_m += weight * errors.median_abs_m;
  sum.p90_abs_m += weight * errors.p90_abs_m;
  sum.p95_abs_m += weight * errors.p95_abs_m;
  sum.coverage += weight * errors.coverage;
}

Json ErrorsJson(const HeldOutErrors& errors) {
  return {{"mean_abs_m", errors.mean_abs_m},
          {"median_abs_m", errors.median_abs_m},
          {"p90_abs_m", errors.p90_abs_m},
          {"p95_abs_m", errors.p95_abs_m},
          {"coverage", errors.coverage},
          {"pixels", errors.pixels}};
}

Json HeldOutJson(const RunResults& results) {
  const std::optional<HeldOutMeans> means = MeansOf(results.held_out);
  if (!means) return nullptr;
  Json json = {{"scans", results.held_out.size()},
               {"before", ErrorsJson(means->before)},
               {"after", ErrorsJson(means->after)}};
  for (const HeldOutResult& scan : results.held_out) {
    json["each"].push_back({{"scan", scan.scan},
                            {"before", ErrorsJson(scan.before)},
                            {"after", ErrorsJson(scan.after)}});
  }
  return json;
}

Json ScansJson(const RunResults& results) {
  return {{"tracked", results.records.size()},
          {"lost", LostScans(results)},
          {"late", results.feed.late},
          {"dropped", results.feed.dropped},
          {"damaged", results.feed.damaged},
          {"backwards", results.feed.backwards},
          {"without_pose", results.without_pose}};
}

Json LatencyJson(const RunResults& results) {
  const Spread latency_ms = LatencyOf(results);
  return {{"p50", latency_ms.p50},
          {"p95", latency_ms.p95},
          {"p99", latency_ms.p99},
          {"max", latency_ms.max}};
}

/// Optimiser steps on the views of single keyframes.
Json TrainingJson(const RunResults& results) {
  std::vector<std::int64_t> steps;
  for (const KeyframeTraining& keyframe : results.training) steps.push_back(keyframe.steps);
  if (steps.empty()) return nullptr;
  return {{"min", Percentile(steps, 0.0)},
          {"median", Percentile(steps, 0.5)},
          {"max", Percentile(steps, 1.0)}};
}

Json MemoryJson(const RunResults& results) {
  const MemoryUse memory = ReadMemoryUse();
  return {{"rss_bytes", memory.rss_bytes},
          {"peak_rss_bytes", memory.peak_rss_bytes},
          {"gaussians_bytes", results.map_memory.gaussians_bytes},
          {"views_bytes", results.map_memory.views_bytes},
          {"places_bytes", results.map_memory.places_bytes}};
}

/// Mean over all scans of what the stages took, and the mapper's total.
Json TimesJson(const RunResults& results) {
  StageTimes sum;
  double track_ms = 0.0;
  for (const ScanRecord& record : results.records) {
    track_ms += record.track_ms;
    for (const auto& [stage, ms] : record.times.Stages()) sum.Add(stage, ms);
  }
  const double scans = std::max<double>(1.0, static_cast<double>(results.records.size()));
  Json json = {{"feed_s", results.feed_s},
               {"finish_s", results.finish_s},
               {"scans_per_s", ScansPerSecond(results)},
               {"latency_ms", LatencyJson(results)},
               {"track_ms_per_scan", track_ms / scans}};
  for (const auto& [stage, ms] : sum.Stages()) {
    json["stage_ms_per_scan"][std::string(stage)] = ms / scans;
  }
  for (const auto& [stage, ms] : results.mapper_times.Stages()) {
    json["mapper_thread_ms"][std::string(stage)] = ms;
  }
  return json;
}

}  // namespace

Trajectory TrajectoryOf(const RunResults& results) {
  Trajectory trajectory;
  for (const ScanRecord& r : results.records) trajectory.push_back({r.stamp_s, r.T_map_sensor});
  return trajectory;
}

std::size_t RecordOf(const RunResults& results, std::int64_t scan) {
  const auto found = std::lower_bound(
      results.records.begin(),
      results.records.end(),
      scan,
      [](const ScanRecord& record, std::int64_t number) { return record.scan < number; });
  return static_cast<std::size_t>(found - results.records.begin());
}

double PathLengthOf(const RunResults& results) {
  std::vector<SE3> poses;
  for (const ScanRecord& record : results.records) poses.push_back(record.T_map_sensor);
  return poses.empty() ? 0.0 : PathLength(poses);
}

std::int64_t LostScans(const RunResults& results) {
  return std::count_if(results.records.begin(), results.records.end(), [](const ScanRecord& r) {
    return r.state == TrackState::kLost;
  });
}

Spread LatencyOf(const RunResults& results) {
  std::vector<double> ms;
  for (const ScanCost& cost : results.costs) ms.push_back(cost.latency_ms);
  if (ms.empty()) return {};
  return {Percentile(ms, 0.5), Percentile(ms, 0.95), Percentile(ms, 0.99), Percentile(ms, 1.0)};
}

double ScansPerSecond(const RunResults& results) {
  if (results.feed_s <= 0.0) return 0.0;
  return static_cast<double>(results.records.size()) / results.feed_s;
}

std::optional<HeldOutMeans> MeansOf(const std::vector<HeldOutResult>& held_out) {
  if (held_out.empty()) return std::nullopt;
  HeldOutMeans means;
  const double weight = 1.0 / static_cast<double>(held_out.size());
  for (const HeldOutResult& scan : held_out) {
    AddScaled(scan.before, weight, means.before);
    AddScaled(scan.after, weight, means.after);
  }
  return means;
}

std::string MetricsJson(const RunResults& results) {
  Json json = {{"version", COVSPLAT_VERSION},
               {"recording", results.recording.string()},
               {"interrupted", results.interrupted},
               {"sensor", results.sensor_verdict},
               {"schedule", results.schedule},
               {"backend", results.backend},
               {"threads", results.threads},
               {"machine", MachineName()},
               {"scans", ScansJson(results)},
               {"path_length_m", PathLengthOf(results)},
               {"time", TimesJson(results)},
               {"memory", MemoryJson(results)},
               {"map",
                {{"gaussians", results.gaussians},
                 {"keyframes", results.keyframes},
                 {"optimizer_steps", results.mapper_steps},
                 {"steps_per_keyframe", TrainingJson(results)},
                 {"file_bytes", results.map_bytes}}},
               {"held_out", HeldOutJson(results)}};
  if (results.loops) {
    json["loops"] = {{"accepted", results.loops->accepted},
                     {"candidates", results.loops->candidates}};
  }
  if (results.truth) json["ground_truth"] = results.truth->path.string();
  json["trajectory_error"] = results.error ? ErrorJson(*results.error) : Json(nullptr);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string LatencyText(const RunResults& results) {
  const Spread ms = LatencyOf(results);
  return fmt::format(
      "median {:.0f} ms, 95 % {:.0f}, 99 % {:.0f}, at most {:.0f}", ms.p50, ms.p95, ms.p99, ms.max);
}

std::string SummaryText(const RunResults& results) {
  const auto count = [](auto n) { return FormatCount(static_cast<double>(n)); };
  std::string scans = count(results.records.size());
  const auto add = [&](std::int64_t n, const char* what) {
    if (n > 0) scans += fmt::format(", {} {}", n, what);
  };
  add(LostScans(results), "lost");
  add(results.feed.late, "late");
  add(results.feed.dropped, "dropped");
  add(results.feed.damaged, "damaged");
  add(results.feed.backwards, "out of order");
  add(results.without_pose, "without a given pose");
  std::string text = fmt::format(
      "scans       {}\nspeed       {:.1f} scan/s ({} and {} to finish)\n"
      "latency     {} to the pose\n"
      "path        {}\nmap         {} Gaussians, {}, {} keyframes\nmemory      {} at most\n",
      scans,
      ScansPerSecond(results),
      FormatSeconds(results.feed_s),
      FormatSeconds(results.finish_s),
      LatencyText(results),
      FormatMetres(PathLengthOf(results)),
      count(results.gaussians),
      FormatBytes(results.map_bytes),
      count(results.keyframes),
      FormatBytes(static_cast<double>(ReadMemoryUse().peak_rss_bytes)));
  if (results.loops) {
    text += fmt::format("loops       {} of {} places that looked alike\n",
                        results.loops->accepted,
                        results.loops->candidates);
  }
  if (const auto means = MeansOf(results.held_out)) {
    text += fmt::format("depth error {} as spawned, {} optimised (mean over {} held-out scans)\n",
                        FormatMetres(means->before.mean_abs_m),
                        FormatMetres(means->after.mean_abs_m),
                        results.held_out.size());
  }
  if (results.error) {
    text += fmt::format("trajectory  {} ATE RMSE to {}\n",
                        FormatMetres(results.error->ate_translation_m.rmse),
                        results.truth->path.string());
  }
  return text;
}

}  // namespace covsplat
