// What `covsplat info` finds out about recordings, maps and runs.
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "covsplat/core/result.hpp"

namespace covsplat {

/// What was detected in a folder of scans, and what to mind when running on it ("hints").
Result<nlohmann::ordered_json> RecordingFacts(const std::filesystem::path& folder);

/// Format, counts, size, statistics, signals and, if the file says, the sensor of a map file.
Result<nlohmann::ordered_json> MapFacts(const std::filesystem::path& file);

/// The metrics of a run folder.
Result<nlohmann::ordered_json> RunFacts(const std::filesystem::path& folder);

}  // namespace covsplat
