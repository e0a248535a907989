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
  Eigen::Vector3d bridge_u;  ///< axis over how far the plane may bridge along it
  Eigen::Vector3d bridge_v;
  Eigen::Array3i low;  ///< voxels that it may reach
  Eigen::Array3i high;
};

/// What discs say of a voxel.
struct DiscSums {
  Voxel inside;                                    ///< those that it lies above or below
  Voxel beside;                                    ///< those that end not far from there
  Eigen::Vector3f pull = Eigen::Vector3f::Zero();  ///< sum of weight * direction to those beside
};

struct FusionJob {
  double truncation_m;
  double voxel_m;
  double sigmas;
  double bridge_m;
};

Plane PlaneOf(const SurfelDisc& disc, const FusionJob& job) {
  const double reach_u = 0.5 * job.sigmas * disc.radius_u + job.bridge_m;
  const double reach_v = 0.5 * job.sigmas * disc.radius_v + job.bridge_m;
  const Eigen::Array3d u = reach_u * disc.axes.col(0).array();
  const Eigen::Array3d v = reach_v * disc.axes.col(1).array();
  // The ellipse, and the truncation to either side.
  const Eigen::Array3d reach =
      (u.square() + v.square()).sqrt() + job.truncation_m * disc.axes.col(2).array().abs();
  return {disc.mean,
          disc.axes.col(2),
          2.0 / disc.radius_u * disc.axes.col(0),
          2.0 / disc.radius_v * disc.axes.col(1),
          disc.axes.col(0) / reach_u,
          disc.axes.col(1) / reach_v,
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

double EllipseAt(const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector3d& at) {
  return std::pow(u.dot(at), 2.0) + std::pow(v.dot(at), 2.0);
}

void AddTo(Voxel& voxel, float share, const Plane& plane, double distance_voxels) {
  voxel.weight += share;
  voxel.distance += share * static_cast<float>(distance_voxels);
  voxel.normal += share * plane.normal.cast<float>();
}

void AddPlane(const Plane& plane,
              const Eigen::Vector3d& position,
              const FusionJob& job,
              DiscSums& sums) {
  const Eigen::Vector3d offset = position - plane.mean;
  const double distance = plane.normal.dot(offset);
  if (distance <= -kBehindShare * job.truncation_m || distance >= job.truncation_m) return;
  const double square = EllipseAt(plane.u, plane.v, offset);
  if (square <= job.sigmas * job.sigmas) {
    const auto share = static_cast<float>(std::exp(-0.5 * square));
    AddTo(sums.inside, share, plane, distance / job.voxel_m);
    return;
  }
  const double beyond = EllipseAt(plane.bridge_u, plane.bridge_v, offset);
  if (beyond >= 1.0) return;
  const auto share = static_cast<float>(1.0 - beyond);
  AddTo(sums.beside, share, plane, distance / job.voxel_m);
  sums.pull -= share * (offset - distance * plane.normal).normalized().cast<float>();
}

/// Adds a plane to the voxels of a block, which begins at voxel `first`.
void FuseIntoBlock(const Plane& plane,
                   const Eigen::Array3i& first,
                   const FusionJob& job,
                   std::span<DiscSums> voxels) {
  const Eigen::Array3i low = (plane.low - first).max(0);
  const Eigen::Array3i high = (plane.high - first).min(kBlockSide - 1);
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const Eigen::Array3i index = first + Eigen::Array3i(x, y, z);
        DiscSums& sums = voxels[static_cast<std::size_t>(VoxelInBlock(x, y, z))];
        AddPlane(plane, job.voxel_m * index.cast<double>().matrix(), job, sums);
      }
    }
  }
}

/// Whether a voxel beside discs lies between them; at the rim of a surface all are on one side.
bool IsGap(const DiscSums& sums) {
  constexpr float kMaxPull = 0.7f;
  return sums.pull.norm() < kMaxPull * sums.beside.weight;
}

/// Discs that overlap are one surface: together they count no more than one in its middle.
void AddSurface(const DiscSums& sums, float weight, Voxel& voxel) {
  const Voxel& surface = sums.inside.weight > 0.0f ? sums.inside : sums.beside;
  if (!(surface.weight > 0.0f)) return;
  if (&surface == &sums.beside && !IsGap(sums)) return;
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
  const FusionJob job = {config.truncation_voxels * voxel_m,
                         voxel_m,
                         config.surfel_sigmas,
                         config.bridge_voxels * voxel_m};
  const std::vector<std::vector<Plane>> planes = PlanesOfBlocks(map, grid, job);
  ParallelFor(pool, grid.Size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<DiscSums> sums;
    for (std::size_t b = begin; b < end; ++b) {
      if (planes[b].empty()) continue;
      sums.assign(grid.Voxels(b).size(), DiscSums());
      const Eigen::Array3i first = kBlockSide * grid.Block(b).array();
      for (const Plane& plane : planes[b]) FuseIntoBlock(plane, first, job, sums);
      for (std::size_t i = 0; i < sums.size(); ++i) {
        AddSurface(sums[i], static_cast<float>(config.surfel_weight), grid.Voxels(b)[i]);
      }
    }
  });
}

}  // namespace covsplat
