#include "covsplat/mesh/surfel_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/mesh/fusion.hpp"

namespace covsplat {
namespace {

/// One disc, ready to be added to voxels.
struct Plane {
  Eigen::Vector3d mean;
  Eigen::Vector3d normal;
  Eigen::Vector3d u;  ///< axis over its standard deviation
  Eigen::Vector3d v;
  Eigen::Array3i low;  ///< voxels that it may reach
  Eigen::Array3i high;
};

struct FusionJob {
  double weight;  ///< of a disc, in its middle
  double truncation_m;
  double voxel_m;
};

Plane PlaneOf(const SurfelDisc& disc, const FusionJob& job) {
  const Eigen::Array3d u = disc.radius_u * disc.axes.col(0).array();
  const Eigen::Array3d v = disc.radius_v * disc.axes.col(1).array();
  // The ellipse, and the truncation to either side.
  const Eigen::Array3d reach =
      (u.square() + v.square()).sqrt() + job.truncation_m * disc.axes.col(2).array().abs();
  return {disc.mean,
          disc.axes.col(2),
          2.0 / disc.radius_u * disc.axes.col(0),
          2.0 / disc.radius_v * disc.axes.col(1),
          ((disc.mean.array() - reach) / job.voxel_m).ceil().cast<int>(),
          ((disc.mean.array() + reach) / job.voxel_m).floor().cast<int>()};
}

int BlockOf(int voxel) {
  return voxel >= 0 ? voxel / kBlockSide : -((kBlockSide - 1 - voxel) / kBlockSide);
}

/// The planes that reach into each block, in the order of their Gaussians.
std::vector<std::vector<Plane>> PlanesOfBlocks(const SurfelMap& map,
                                               const VoxelGrid& grid,
                                               const FusionJob& job) {
  std::vector<std::vector<Plane>> planes(grid.Size());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const Plane plane = PlaneOf(DiscOf(map, i), job);
    for (int z = BlockOf(plane.low.z()); z <= BlockOf(plane.high.z()); ++z) {
      for (int y = BlockOf(plane.low.y()); y <= BlockOf(plane.high.y()); ++y) {
        for (int x = BlockOf(plane.low.x()); x <= BlockOf(plane.high.x()); ++x) {
          const std::int64_t number = grid.Find({x, y, z});
          if (number >= 0) planes[static_cast<std::size_t>(number)].push_back(plane);
        }
      }
    }
  }
  return planes;
}

/// Where most views look through, a disc has nothing to say: what it shows has moved on.
bool IsFree(const Voxel& voxel, float truncation_voxels) {
  return voxel.distance > 0.7f * truncation_voxels * voxel.weight;
}

void AddPlane(const Plane& plane,
              const Eigen::Vector3d& position,
              const FusionJob& job,
              Voxel& voxel) {
  constexpr double kMaxSquare = 4.0;  // two standard deviations
  const Eigen::Vector3d offset = position - plane.mean;
  const double distance = plane.normal.dot(offset);
  if (distance <= -kBehindShare * job.truncation_m || distance >= job.truncation_m) return;
  const double u = plane.u.dot(offset);
  const double v = plane.v.dot(offset);
  const double square = u * u + v * v;
  if (square > kMaxSquare) return;
  const auto share = static_cast<float>(job.weight * std::exp(-0.5 * square));
  voxel.weight += share;
  voxel.distance += share * static_cast<float>(distance / job.voxel_m);
  voxel.normal += share * plane.normal.cast<float>();
}

/// Adds a plane to the voxels of a block, which begins at voxel `first`, but for the free ones.
void FuseIntoBlock(const Plane& plane,
                   const Eigen::Array3i& first,
                   const std::vector<std::uint8_t>& is_free,
                   const FusionJob& job,
                   std::span<Voxel> voxels) {
  const Eigen::Array3i low = (plane.low - first).max(0);
  const Eigen::Array3i high = (plane.high - first).min(kBlockSide - 1);
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const Eigen::Array3i index = first + Eigen::Array3i(x, y, z);
        const auto i = static_cast<std::size_t>(VoxelInBlock(x, y, z));
        if (is_free[i] != 0) continue;
        AddPlane(plane, job.voxel_m * index.cast<double>().matrix(), job, voxels[i]);
      }
    }
  }
}

}  // namespace

void FuseSurfels(const SurfelMap& map,
                 const MeshConfig& config,
                 VoxelGrid& grid,
                 ThreadPool& pool) {
  if (config.surfel_weight <= 0.0) return;
  const double voxel_m = grid.VoxelSize();
  const FusionJob job = {config.surfel_weight, config.truncation_voxels * voxel_m, voxel_m};
  const std::vector<std::vector<Plane>> planes = PlanesOfBlocks(map, grid, job);
  ParallelFor(pool, grid.Size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const Eigen::Array3i first = kBlockSide * grid.Block(b).array();
      const std::span<Voxel> voxels = grid.Voxels(b);
      std::vector<std::uint8_t> is_free(voxels.size());
      for (std::size_t i = 0; i < voxels.size(); ++i) {
        is_free[i] = IsFree(voxels[i], static_cast<float>(config.truncation_voxels)) ? 1 : 0;
      }
      for (const Plane& plane : planes[b]) FuseIntoBlock(plane, first, is_free, job, voxels);
    }
  });
}

}  // namespace covsplat
