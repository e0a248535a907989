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
  const auto share = static_cast<float>(std::exp(-0.5 * square));
  voxel.weight += share;
  voxel.distance += share * static_cast<float>(distance / job.voxel_m);
  voxel.normal += share * plane.normal.cast<float>();
}

/// Adds a plane to the voxels of a block, which begins at voxel `first`.
void FuseIntoBlock(const Plane& plane,
                   const Eigen::Array3i& first,
                   const FusionJob& job,
                   std::span<Voxel> voxels) {
  const Eigen::Array3i low = (plane.low - first).max(0);
  const Eigen::Array3i high = (plane.high - first).min(kBlockSide - 1);
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const Eigen::Array3i index = first + Eigen::Array3i(x, y, z);
        Voxel& voxel = voxels[static_cast<std::size_t>(VoxelInBlock(x, y, z))];
        AddPlane(plane, job.voxel_m * index.cast<double>().matrix(), job, voxel);
      }
    }
  }
}

/// Discs that overlap are one surface: together they count no more than one in its middle.
void AddSurface(const Voxel& surface, float weight, Voxel& voxel) {
  if (!(surface.weight > 0.0f)) return;
  const float share = weight / std::max(1.0f, surface.weight);
  voxel.weight += share * surface.weight;
  voxel.distance += share * surface.distance;
  voxel.normal += share * surface.normal;
}

}  // namespace

void FuseSurfels(const SurfelMap& map,
                 const MeshConfig& config,
                 VoxelGrid& grid,
                 ThreadPool& pool) {
  if (config.surfel_weight <= 0.0) return;
  const double voxel_m = grid.VoxelSize();
  const FusionJob job = {config.truncation_voxels * voxel_m, voxel_m};
  const std::vector<std::vector<Plane>> planes = PlanesOfBlocks(map, grid, job);
  ParallelFor(pool, grid.Size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const Eigen::Array3i first = kBlockSide * grid.Block(b).array();
      std::vector<Voxel> surface(grid.Voxels(b).size());
      for (const Plane& plane : planes[b]) FuseIntoBlock(plane, first, job, surface);
      for (std::size_t i = 0; i < surface.size(); ++i) {
        AddSurface(surface[i], static_cast<float>(config.surfel_weight), grid.Voxels(b)[i]);
      }
    }
  });
}

}  // namespace covsplat
