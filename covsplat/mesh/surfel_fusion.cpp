#include "covsplat/mesh/surfel_fusion.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
namespace {

/// Depth behind a disc that counts, as for views.
constexpr double kBehindShare = 2.0 / 3.0;

/// Limits of what a disc reaches: its ellipse, and the truncation to either side.
struct Box {
  Eigen::Array3d low;
  Eigen::Array3d high;
};

Box BoxOf(const SurfelDisc& disc, double truncation_m) {
  const Eigen::Array3d u = disc.radius_u * disc.axes.col(0).array();
  const Eigen::Array3d v = disc.radius_v * disc.axes.col(1).array();
  const Eigen::Array3d reach =
      (u.square() + v.square()).sqrt() + truncation_m * disc.axes.col(2).array().abs();
  return {disc.mean.array() - reach, disc.mean.array() + reach};
}

/// Voxel indices of a box.
struct VoxelBox {
  Eigen::Array3i low;
  Eigen::Array3i high;
};

VoxelBox VoxelsOf(const Box& box, double voxel_m) {
  return {(box.low / voxel_m).ceil().cast<int>(), (box.high / voxel_m).floor().cast<int>()};
}

int BlockOf(int voxel) {
  return voxel >= 0 ? voxel / kBlockSide : -((kBlockSide - 1 - voxel) / kBlockSide);
}

/// The Gaussians that reach into each block, in their order.
std::vector<std::vector<std::size_t>> SurfelsOfBlocks(const SurfelMap& map,
                                                      const VoxelGrid& grid,
                                                      double truncation_m) {
  std::vector<std::vector<std::size_t>> surfels(grid.Size());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const VoxelBox box = VoxelsOf(BoxOf(DiscOf(map, i), truncation_m), grid.VoxelSize());
    for (int z = BlockOf(box.low.z()); z <= BlockOf(box.high.z()); ++z) {
      for (int y = BlockOf(box.low.y()); y <= BlockOf(box.high.y()); ++y) {
        for (int x = BlockOf(box.low.x()); x <= BlockOf(box.high.x()); ++x) {
          const std::int64_t number = grid.Find({x, y, z});
          if (number >= 0) surfels[static_cast<std::size_t>(number)].push_back(i);
        }
      }
    }
  }
  return surfels;
}

/// One disc, ready to be added to voxels.
struct Plane {
  Eigen::Vector3d mean;
  Eigen::Vector3d normal;
  Eigen::Vector3d u;  ///< axis over its standard deviation
  Eigen::Vector3d v;
};

void AddPlane(const Plane& plane,
              const Eigen::Vector3d& position,
              double weight,
              double truncation_m,
              double voxel_m,
              Voxel& voxel) {
  constexpr double kMaxSquare = 4.0;  // two standard deviations
  const Eigen::Vector3d offset = position - plane.mean;
  const double distance = plane.normal.dot(offset);
  if (distance <= -kBehindShare * truncation_m || distance >= truncation_m) return;
  const double u = plane.u.dot(offset);
  const double v = plane.v.dot(offset);
  const double square = u * u + v * v;
  if (square > kMaxSquare) return;
  const auto share = static_cast<float>(weight * std::exp(-0.5 * square));
  voxel.weight += share;
  voxel.distance += share * static_cast<float>(distance / voxel_m);
  voxel.normal += share * plane.normal.cast<float>();
}

}  // namespace

void FuseSurfels(const SurfelMap& map,
                 const MeshConfig& config,
                 VoxelGrid& grid,
                 ThreadPool& pool) {
  if (config.surfel_weight <= 0.0) return;
  const double voxel_m = grid.VoxelSize();
  const double truncation_m = config.truncation_voxels * voxel_m;
  const auto surfels = SurfelsOfBlocks(map, grid, truncation_m);
  ParallelFor(pool, grid.Size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const Eigen::Array3i first = kBlockSide * grid.Block(b).array();
      const std::span<Voxel> voxels = grid.Voxels(b);
      for (const std::size_t i : surfels[b]) {
        const SurfelDisc disc = DiscOf(map, i);
        const Plane plane{disc.mean,
                          disc.axes.col(2),
                          2.0 / disc.radius_u * disc.axes.col(0),
                          2.0 / disc.radius_v * disc.axes.col(1)};
        const VoxelBox box = VoxelsOf(BoxOf(disc, truncation_m), voxel_m);
        const Eigen::Array3i low = (box.low - first).max(0);
        const Eigen::Array3i high = (box.high - first).min(kBlockSide - 1);
        for (int z = low.z(); z <= high.z(); ++z) {
          for (int y = low.y(); y <= high.y(); ++y) {
            for (int x = low.x(); x <= high.x(); ++x) {
              const Eigen::Array3i index = first + Eigen::Array3i(x, y, z);
              AddPlane(plane,
                       voxel_m * index.cast<double>().matrix(),
                       config.surfel_weight,
                       truncation_m,
                       voxel_m,
                       voxels[static_cast<std::size_t>(VoxelInBlock(x, y, z))]);
            }
          }
        }
      }
    }
  });
}

}  // namespace covsplat
