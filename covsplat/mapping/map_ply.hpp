// Maps as PLY files of 3D Gaussians, which splat viewers open; our own signals are further
// properties.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "covsplat/core/result.hpp"
#include "covsplat/mapping/saved_map.hpp"

namespace covsplat {

/// Writes binary little-endian floats, at once: x y z, normal, colour (from the normal, as f_dc),
/// opacity (logit), scale_0 to 2 (logarithm; the third is the thickness of the disc), rot_0 to 3
/// (w x y z), confidence, control_score, intensity, keyframe, last_seen.
Result<void> WriteMapPly(const std::filesystem::path& path, const SavedMap& map);

/// Reads what WriteMapPly wrote. Of other files of 3D Gaussians it reads what they have: the
/// thinnest axis becomes the normal, signals that are missing are as where they are unknown. `file`
/// is for messages.
Result<SavedMap> ParseMapPly(std::string_view bytes, const std::string& file);

}  // namespace covsplat
