// Surfaces as points: meshes sampled evenly by area, then one point per voxel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat {

struct SamplingOptions {
  double voxel_m = 0.02;           ///< the samples of a voxel become their mean
  double samples_per_voxel = 6.0;  ///< drawn per area of a voxel's side
  std::uint64_t seed = 1;
};

/// What is wrong with the triangles of a mesh, and how much of it is left.
struct MeshCheck {
  std::size_t not_finite = 0;  ///< triangles with a corner that is NaN or infinite
  std::size_t no_area = 0;     ///< triangles without area
  double area_m2 = 0.0;        ///< of all others
};
MeshCheck CheckMesh(const TriangleMesh& mesh);

/// Points on the triangles that have an area, moved to the world. Each triangle draws from its own
/// random numbers, so the result depends on mesh, pose and options alone. Works tile by tile:
/// memory is that of the result, not of the samples drawn.
std::vector<Eigen::Vector3d> SampleMesh(const TriangleMesh& mesh,
                                        const SE3& T_world_mesh,
                                        const SamplingOptions& options,
                                        ThreadPool& pool);

/// The mean of the points of each voxel. Points that are not finite do not count.
std::vector<Eigen::Vector3d> ThinPoints(std::span<const Eigen::Vector3d> points, double voxel_m);

}  // namespace covsplat
