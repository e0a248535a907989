// A surface to judge or to judge by: a triangle mesh or a cloud of points, from a file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "covsplat/core/result.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/eval/surface_samples.hpp"

namespace covsplat {

struct Surface {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> points;  ///< finite, m; used if the mesh has no triangles
  std::vector<std::string> remarks;     ///< what was left out, for people

  bool IsMesh() const { return !mesh.triangles.empty(); }
};

/// A PLY mesh, or the points of a PLY without faces or of a PCD file. What cannot be used (corners
/// or points that are not finite, triangles without area) becomes a remark; a surface of which
/// nothing is left is an error. Triangles need not be a manifold.
Result<Surface> LoadSurface(const std::filesystem::path& path);

/// Of all finite vertices or points.
Eigen::AlignedBox3d BoundsOf(const Surface& surface, const SE3& T_world_surface = {});

/// The points that stand for a surface in the measures, at most one per voxel. The error says when
/// there would be too many of them or they would lie too far out.
Result<std::vector<Eigen::Vector3d>> PointsOf(const Surface& surface,
                                              const SE3& T_world_surface,
                                              const SamplingOptions& options,
                                              ThreadPool& pool);

/// What is odd about where two surfaces lie: sizes a thousandfold apart, or nothing in common.
std::optional<std::string> OddBounds(const Eigen::AlignedBox3d& result,
                                     const Eigen::AlignedBox3d& truth);

}  // namespace covsplat
