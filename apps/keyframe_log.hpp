// keyframes.csv: what optimisation did by each keyframe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "covsplat/core/result.hpp"
#include "covsplat/mapping/training_views.hpp"

namespace covsplat {

/// One row per keyframe, in the order of their numbers; `keyframe_scans` has the scan of each.
Result<void> WriteKeyframes(const std::filesystem::path& folder,
                            std::span<const KeyframeTraining> training,
                            std::span<const std::int64_t> keyframe_scans);

}  // namespace covsplat
