// The report of a run: plain data in, one self-contained HTML page out. No scripts, nothing loaded
// from elsewhere.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/image.hpp"
#include "covsplat/report/plot.hpp"
#include "covsplat/report/png.hpp"

namespace covsplat {

/// The numbers of the tiles on top.
struct ReportSummary {
  std::int64_t scans = 0;
  std::int64_t lost_scans = 0;     ///< tracked without success
  std::int64_t late_scans = 0;     ///< waited for the run
  std::int64_t dropped_scans = 0;  ///< never tracked: the input was faster than the run
  std::int64_t keyframes = 0;
  double path_length_m = 0.0;
  double scans_per_s = 0.0;
  double wall_s = 0.0;
  std::int64_t gaussians = 0;
  double map_bytes = 0.0;
  double final_rss_bytes = 0.0;
  double peak_rss_bytes = 0.0;
  std::optional<double> ate_rmse_m;  ///< with a ground truth only
};

struct ReportPicture {
  std::string caption;
  Image<Rgb> image;
};

/// A scan that the map was not trained on.
struct HeldOutScan {
  std::int64_t scan = 0;
  std::optional<double> before_m;  ///< mean absolute depth error before optimisation
  std::optional<double> after_m;   ///< and with the final map
  Image<float> measured_m;         ///< 0 without a return; may be empty: then there is no picture
  Image<float> rendered_m;         ///< 0 where the map shows nothing; as large as measured_m
};

struct ReportEvent {
  enum class Level { kInfo, kWarning };
  Level level = Level::kInfo;
  std::int64_t scan = -1;  ///< -1: concerns no scan in particular
  std::string text;
};

/// Everything is optional: sections without data are left out. Series per scan start at scan 0.
struct ReportData {
  std::string title = "covsplat run";
  std::string subtitle;  ///< for example the input and the date
  ReportSummary summary;

  std::vector<Eigen::Vector3d> trajectory_m;  ///< per scan, in the map frame
  std::vector<Eigen::Vector3d> truth_m;       ///< aligned to the map frame
  std::vector<std::size_t> keyframes;         ///< indices into trajectory_m
  std::vector<std::size_t> loops_closed;      ///< where places were known again, as indices
  std::vector<std::size_t> loops_rejected;    ///< and where a look showed that they were not
  std::vector<double> drift_path_m;           ///< path length ...
  std::vector<double> drift_m;                ///< ... and position error there

  std::vector<ReportPicture> map_pictures;
  std::vector<HeldOutScan> held_out;

  std::vector<StackLayer> stage_ms;    ///< per stage, ms of every scan
  std::vector<double> latency_ms;      ///< per scan
  std::vector<double> keyframe_steps;  ///< per keyframe: optimiser steps on its view
  std::vector<double> gaussians;       ///< per scan
  std::vector<double> rss_bytes;       ///< per scan

  std::vector<ReportEvent> events;
  std::string config_yaml;

  std::string version;
  std::string command_line;
  std::string input;
  std::vector<std::pair<std::string, std::string>> details;  ///< further rows: what, value
};

std::string MakeReport(const ReportData& data);

}  // namespace covsplat
