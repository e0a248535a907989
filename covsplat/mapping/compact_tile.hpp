// One tile of a .csmap file: a cube of 64 m whose Gaussians are columns of small integers.
// docs/map_format.md describes the bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/mapping/saved_map.hpp"

namespace covsplat {

/// A tile holds no more; where there are more, several tiles cover the same cube.
inline constexpr std::size_t kMaxTileGaussians = std::size_t{1} << 20;

/// Some of a map's rows, all in one cube.
struct TileRows {
  std::array<std::int32_t, 3> cube = {};  ///< multiples of 64 m
  std::vector<std::size_t> rows;          ///< along the cube's Morton curve
};

/// All rows that can be drawn, cube by cube. Left out are those with a number that is not finite, a
/// rotation of no length, or a mean 10 000 km away.
std::vector<TileRows> SortIntoTiles(const SavedMap& map);

std::string PackTile(const SavedMap& map, const TileRows& tile);

/// The Gaussians of a tile; nothing if PackTile cannot have written these bytes.
std::optional<SavedMap> UnpackTile(std::string_view bytes);

}  // namespace covsplat
