// The flags of `covsplat run`.
#pragma once

#include "apps/config_options.hpp"
#include "apps/slam_run.hpp"

namespace covsplat {

struct RunOptions {
  std::string recording;
  std::string out;
  bool overwrite = false;
  ConfigOptions config;
  std::int64_t scans = 0;
  std::int64_t jump = 1;
  std::int64_t first = 0;
  int threads = 0;
  std::string backend;
  std::string format;
  std::string loops;
  bool deterministic = false;
  bool realtime = false;
  double rate = 1.0;
  bool quiet = false;
  std::string truth;
  std::string poses;
  double kitti_correction_deg = 0.0;
};

/// `options` must outlive the parsing.
void AddRunOptions(CLI::App& command, RunOptions& options);

/// Flags win over configuration files and --set.
Result<RunRequest> RequestOf(const RunOptions& options);

}  // namespace covsplat
