// Everything a run found out, as plain data: metrics.json, the summary and the report are made of
// it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/run_log.hpp"
#include "apps/scan_feed.hpp"

#include "covsplat/eval/trajectory_error.hpp"
#include "covsplat/io/ground_truth.hpp"
#include "covsplat/mapping/held_out.hpp"
#include "covsplat/report/png.hpp"
#include "covsplat/slam/slam_system.hpp"

namespace covsplat {

struct HeldOutResult {
  std::int64_t scan = 0;
  HeldOutErrors before;  ///< with the Gaussians as they were spawned
  HeldOutErrors after;
  Image<float> measured_m;
  Image<float> rendered_m;
};

struct MapPicture {
  std::string caption;
  Image<Rgb> image;
};

struct LoopCounts {
  std::int64_t accepted = 0;
  std::int64_t candidates = 0;  ///< pairs of places that were looked at
};

struct RunResults {
  std::filesystem::path recording;
  std::string title;   ///< of the report
  std::string source;  ///< what the recording is
  std::string command_line;
  std::string sensor_verdict;
  std::string schedule;
  std::string backend;  ///< what it ran on: SplatEngine::Device()
  int threads = 0;
  bool interrupted = false;

  std::vector<ScanRecord> records;  ///< one per tracked scan
  std::vector<ScanCost> costs;      ///< as many
  FeedCounts feed;
  std::int64_t without_pose = 0;  ///< scans that the given poses do not cover
  std::vector<FeedProblem> problems;
  double feed_s = 0.0;    ///< wall time from the first scan to the last
  double finish_s = 0.0;  ///< and from there until the map was at rest

  std::optional<LoopCounts> loops;  ///< nothing if they were off

  std::size_t gaussians = 0;
  std::size_t keyframes = 0;
  std::int64_t mapper_steps = 0;
  std::vector<KeyframeTraining> training;  ///< [keyframes]
  MapMemory map_memory;
  StageTimes mapper_times;
  double map_bytes = 0.0;
  std::vector<MapPicture> pictures;
  std::vector<HeldOutResult> held_out;

  std::optional<GroundTruth> truth;
  std::optional<TrajectoryError> error;  ///< if there is truth for any pose
};

/// Of the tracked scans, at mid scan.
Trajectory TrajectoryOf(const RunResults& results);
/// Where in `records` a scan is, or would be.
std::size_t RecordOf(const RunResults& results, std::int64_t scan);
double PathLengthOf(const RunResults& results);
std::int64_t LostScans(const RunResults& results);
double ScansPerSecond(const RunResults& results);

/// The value that a share of all does not exceed, and the largest.
struct Spread {
  double p50 = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};
/// From each scan's arrival to its pose, in ms; zeros without any scan.
Spread LatencyOf(const RunResults& results);
/// The same for people.
std::string LatencyText(const RunResults& results);

/// Mean over the held-out scans; nothing without any.
struct HeldOutMeans {
  HeldOutErrors before;
  HeldOutErrors after;
};
std::optional<HeldOutMeans> MeansOf(const std::vector<HeldOutResult>& held_out);

/// metrics.json
std::string MetricsJson(const RunResults& results);

/// A few lines for the terminal.
std::string SummaryText(const RunResults& results);

}  // namespace covsplat
