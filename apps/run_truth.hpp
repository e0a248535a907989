// Trajectories that come with a recording, from files in either format.
#pragma once

#include <filesystem>
#include <optional>

#include "covsplat/io/ground_truth.hpp"

namespace covsplat {

/// A TUM file, or a KITTI file whose lines belong to the recording's scans.
Result<Trajectory> LoadForRecording(const std::filesystem::path& file,
                                    const std::filesystem::path& recording,
                                    double scan_period_s);

/// The given ground truth, or the one that lies with the recording, if any.
Result<std::optional<GroundTruth>> LoadTruth(const std::filesystem::path& recording,
                                             const std::optional<std::filesystem::path>& given,
                                             double scan_period_s);

}  // namespace covsplat
