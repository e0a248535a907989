// What one beam of a LiDAR brings back: noise, drop-outs, mixed pixels, intensity.
#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "covsplat/sim/lidar_config.hpp"
#include "covsplat/sim/world_snapshot.hpp"

namespace covsplat {

struct BeamReturn {
  float range_m = 0.0f;
  float intensity = 0.0f;  ///< within [0, 1]; falls with range and incidence from the reflectivity
  PointLabel label = PointLabel::kStatic;
};

/// Sends a beam along a unit vector of the world frame. `number` tells it from all other beams of a
/// recording and, with the seed of `config`, decides all that is random about it.
///
/// A beam is as wide as its divergence. Somewhere in that width a second ray is cast; where it
/// meets another surface than the middle does, and both are within the length of a pulse, the
/// return may come from anywhere between the two.
std::optional<BeamReturn> SendBeam(const WorldSnapshot& world,
                                   const Eigen::Vector3f& direction,
                                   const SimulatedLidarConfig& config,
                                   std::uint64_t number);

}  // namespace covsplat
