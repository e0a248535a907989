// PoissonOfMap: a closed surface through points on the Gaussians' discs, trimmed to where they are.
#pragma once

#include "covsplat/mesh/map_mesher.hpp"

namespace covsplat {

/// The other way to a mesh (MeshMethod::kPoisson): screened Poisson reconstruction (Kazhdan and
/// Hoppe, ACM TOG 2013) of points that sample the discs, in an octree with cells of about a voxel;
/// what it makes up farther than two voxels from all points is cut off. It bridges small holes and
/// rounds edges. Errors: as MeshOfMap; kUnavailable if this build is without Open3D.
Result<MeshResult> PoissonOfMap(const SurfelMap& map, const MeshConfig& config);

}  // namespace covsplat
