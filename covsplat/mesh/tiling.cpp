#include "covsplat/mesh/tiling.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
namespace {

/// Vertices of the surface are numbered by 20 bits per axis; some are left for neighbours.
constexpr double kMaxVoxelIndex = (1 << 19) - 4 * kBlockSide;
constexpr std::size_t kSurfelsPerTask = 1024;

void SortUnique(std::vector<BlockIndex>& blocks) {
  std::sort(blocks.begin(), blocks.end(), BlockOrder);
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
}

/// Blocks that the disc's points, half a block apart, have within the margin.
void AppendBlocks(const SurfelDisc& disc,
                  double block_m,
                  double margin_m,
                  std::vector<BlockIndex>& blocks) {
  const int steps_u = static_cast<int>(std::ceil(disc.radius_u / (0.5 * block_m)));
  const int steps_v = static_cast<int>(std::ceil(disc.radius_v / (0.5 * block_m)));
  for (int i = -steps_u; i <= steps_u; ++i) {
    for (int j = -steps_v; j <= steps_v; ++j) {
      const double u = steps_u > 0 ? static_cast<double>(i) / steps_u : 0.0;
      const double v = steps_v > 0 ? static_cast<double>(j) / steps_v : 0.0;
      if (u * u + v * v > 1.0 + 1e-9) continue;
      const Eigen::Vector3d p = disc.mean + disc.axes.col(0) * (u * disc.radius_u) +
                                disc.axes.col(1) * (v * disc.radius_v);
      const Eigen::Array3i low = ((p.array() - margin_m) / block_m).floor().cast<int>();
      const Eigen::Array3i high = ((p.array() + margin_m) / block_m).floor().cast<int>();
      for (int z = low.z(); z <= high.z(); ++z) {
        for (int y = low.y(); y <= high.y(); ++y) {
          for (int x = low.x(); x <= high.x(); ++x) blocks.emplace_back(x, y, z);
        }
      }
    }
  }
}

Result<void> CheckExtent(const SurfelMap& map, double voxel_m) {
  double farthest = 0.0;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    farthest = std::max(farthest, DiscOf(map, i).mean.cwiseAbs().maxCoeff());
  }
  if (farthest / voxel_m < kMaxVoxelIndex) return {};
  return Fail(ErrorCode::kUsage,
              "the map reaches {:.0f} m from its origin, too far for voxels of {} m; choose larger "
              "ones with --voxel",
              farthest,
              voxel_m);
}

using BlockIterator = std::vector<BlockIndex>::iterator;

/// Halves [begin, end) until every part is small enough; parts are appended in order.
void Split(BlockIterator begin,
           BlockIterator end,
           std::size_t max_blocks,
           std::vector<std::vector<BlockIndex>>& parts) {
  if (static_cast<std::size_t>(end - begin) <= max_blocks) {
    parts.emplace_back(begin, end);
    std::sort(parts.back().begin(), parts.back().end(), BlockOrder);
    return;
  }
  Eigen::Array3i low = begin->array();
  Eigen::Array3i high = low;
  for (auto block = begin; block != end; ++block) {
    low = low.min(block->array());
    high = high.max(block->array());
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const auto before = [axis](const BlockIndex& a, const BlockIndex& b) {
    return a[axis] != b[axis] ? a[axis] < b[axis] : BlockOrder(a, b);
  };
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, before);
  Split(begin, middle, max_blocks, parts);
  Split(middle, end, max_blocks, parts);
}

std::vector<BlockIndex> WithNeighbours(const std::vector<BlockIndex>& own,
                                       const std::vector<BlockIndex>& all) {
  std::vector<BlockIndex> wanted;
  for (const BlockIndex& block : own) {
    for (int n = 0; n < 27; ++n) {
      wanted.push_back(block + BlockIndex(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
    }
  }
  SortUnique(wanted);
  std::vector<BlockIndex> padded;
  std::set_intersection(
      wanted.begin(), wanted.end(), all.begin(), all.end(), std::back_inserter(padded), BlockOrder);
  return padded;
}

}  // namespace

Result<std::vector<BlockIndex>> BlocksNear(const SurfelMap& map,
                                           double voxel_m,
                                           double margin_m,
                                           ThreadPool& pool) {
  if (const Result<void> fits = CheckExtent(map, voxel_m); !fits) return Forward(fits);
  const std::size_t tasks = (map.Size() + kSurfelsPerTask - 1) / kSurfelsPerTask;
  std::vector<std::vector<BlockIndex>> parts(tasks);
  ParallelFor(pool, map.Size(), kSurfelsPerTask, [&](std::size_t begin, std::size_t end) {
    std::vector<BlockIndex>& part = parts[begin / kSurfelsPerTask];
    for (std::size_t i = begin; i < end; ++i) {
      AppendBlocks(DiscOf(map, i), kBlockSide * voxel_m, margin_m, part);
    }
    SortUnique(part);
  });
  std::vector<BlockIndex> blocks;
  for (const auto& part : parts) blocks.insert(blocks.end(), part.begin(), part.end());
  SortUnique(blocks);
  return blocks;
}

std::vector<Tile> SplitIntoTiles(const std::vector<BlockIndex>& blocks, int max_blocks) {
  std::vector<Tile> tiles;
  if (blocks.empty()) return tiles;
  std::vector<BlockIndex> shuffled = blocks;
  std::vector<std::vector<BlockIndex>> parts;
  Split(shuffled.begin(), shuffled.end(), static_cast<std::size_t>(max_blocks), parts);
  for (std::vector<BlockIndex>& own : parts) {
    Tile tile{std::move(own), {}};
    tile.padded = WithNeighbours(tile.own, blocks);
    tiles.push_back(std::move(tile));
  }
  return tiles;
}

}  // namespace covsplat
