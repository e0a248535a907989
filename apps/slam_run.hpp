// One run of the SLAM on a recording, from its folder to the files and the summary.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/app_config.hpp"
#include "apps/exit_code.hpp"
#include "apps/run_folder.hpp"

namespace covsplat {

struct RunRequest {
  std::filesystem::path recording;
  std::string title;  ///< of the report; empty: the name of the recording
  RunFolderRequest folder;
  AppConfig config;
  std::int64_t first_scan = 0;
  std::int64_t max_scans = -1;  ///< to track; -1: all
  std::int64_t jump = 1;        ///< track every n-th scan
  double realtime_rate =
      0.0;  ///< feed scans so many times as fast as they came; 0: as fast as can be
  bool quiet = false;
  std::optional<std::filesystem::path> truth;  ///< trajectory to evaluate against
  std::optional<std::filesystem::path> poses;  ///< trajectory to map with instead of tracking
  GivenPoses poses_meaning = GivenPoses::kExact;
  std::string command_line;
};

/// Runs until the recording ends or a signal comes (see InterruptGuard, which the caller holds) and
/// prints what there is to say.
ExitCode RunSlam(const RunRequest& request);

}  // namespace covsplat
