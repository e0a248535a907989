// The end of a run: what it was worth, and the files that say so.
#pragma once

#include <filesystem>
#include <string>

#include "apps/app_config.hpp"
#include "apps/run_results.hpp"

namespace covsplat {

/// Measures the map and the trajectory of a finished system, and writes map.ply, metrics.json and
/// report.html. Writes what it can; the first failure comes back.
Result<void> ConcludeRun(SlamSystem& system,
                         const AppConfig& config,
                         const std::string& config_yaml,
                         const std::filesystem::path& folder,
                         RunResults& results);

}  // namespace covsplat
