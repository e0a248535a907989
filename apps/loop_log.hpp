// What a run says of its loops.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "covsplat/core/result.hpp"
#include "covsplat/loops/loop_closer.hpp"

namespace covsplat {

/// loops.csv, a row for every pair of places that was looked at, with its fate, and pose_graph.g2o.
/// `keyframe_scans`: the scan of each keyframe.
Result<void> WriteLoops(const std::filesystem::path& folder,
                        const LoopCloser& closer,
                        std::span<const std::int64_t> keyframe_scans);

}  // namespace covsplat
