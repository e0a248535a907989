// Where the distance field is needed, and in which pieces it is made.
#pragma once

#include <vector>

#include "covsplat/core/parallel.hpp"
#include "covsplat/mesh/surfel_map.hpp"
#include "covsplat/mesh/voxel_grid.hpp"

namespace covsplat {

/// The blocks within `margin_m` of any Gaussian's disc (two standard deviations), in BlockOrder.
Result<std::vector<BlockIndex>> BlocksNear(const SurfelMap& map,
                                           double voxel_m,
                                           double margin_m,
                                           ThreadPool& pool);

/// A piece of the field that is made at once.
struct Tile {
  std::vector<BlockIndex> own;     ///< blocks whose surface this tile extracts
  std::vector<BlockIndex> padded;  ///< own and all neighbours that exist, in BlockOrder
};

/// Splits blocks along the longest side of their bounding box until no tile owns more than
/// `max_blocks`. Every block has one owner.
std::vector<Tile> SplitIntoTiles(const std::vector<BlockIndex>& blocks, int max_blocks);

}  // namespace covsplat
