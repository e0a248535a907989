// SurfelMap: a finished map as plain data, ready to be rendered.
#pragma once

#include <memory>
#include <vector>

#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// Gaussians in the map frame, each with the keyframe it came with.
struct SurfelMap {
  GaussianColumns<float> gaussians;
  std::vector<int> keyframe;        ///< [N] index of T_map_keyframe
  std::vector<float> confidence;    ///< [N] u, in [0, 1]
  std::vector<float> intensity;     ///< [N] 0 if the recording has none
  std::vector<SE3> T_map_keyframe;  ///< [K]

  std::size_t Size() const { return gaussians.Size(); }
};

/// What a Gaussian covers, in the map frame: a flat ellipse of two standard deviations.
struct SurfelDisc {
  Eigen::Vector3d mean;
  Eigen::Matrix3d axes;  ///< columns: along the radii, and the normal
  double radius_u = 0.0;
  double radius_v = 0.0;
};

SurfelDisc DiscOf(const SurfelMap& map, std::size_t i);

/// Removes Gaussians with a number that is not finite or a rotation of no length; returns how many.
std::size_t DropBroken(SurfelMap& map);

/// An engine that renders the map. Gaussians are stored relative to their keyframes, so that
/// precision does not fade with the distance from the origin. `pool` must outlive the engine.
Result<std::unique_ptr<SplatEngine>> MakeMapEngine(const SurfelMap& map,
                                                   Backend backend,
                                                   const SensorModel& sensor,
                                                   const EngineConfig& config,
                                                   ThreadPool& pool);

/// A voxel that resolves what the map resolves: half the Gaussians' median extent (a standard
/// deviation), to two digits, within [0.02, 0.5] m. The map must not be empty.
double VoxelFor(const SurfelMap& map);

}  // namespace covsplat
