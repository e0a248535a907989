// .csmap: a map in 16 bytes or less per Gaussian, with its keyframes, sensor and configuration,
// checksummed. docs/map_format.md describes the bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "covsplat/core/result.hpp"
#include "covsplat/mapping/saved_map.hpp"

namespace covsplat {

/// The version that is written; it and those before it are read.
inline constexpr std::uint32_t kCompactMapVersion = 1;

/// What every version starts with.
inline constexpr std::string_view kCompactMapMagic("CSMAP\r\n\x1a", 8);

/// The bytes of a file, the same for the same map. Gaussians are in another order, and those that
/// cannot be drawn are left out.
std::string PackCompactMap(const SavedMap& map);

/// Reads what PackCompactMap made; `file` is for messages. Errors name the place and what to do.
Result<SavedMap> ParseCompactMap(std::string_view bytes, const std::string& file);

}  // namespace covsplat
