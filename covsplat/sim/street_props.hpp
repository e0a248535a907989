// Things that stand or move in streets. Each appends itself to a mesh; `base` is the point on the
// ground that it stands on, in the world frame, lengths in metres; it faces the direction
// `yaw_rad`.
#pragma once

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// A saloon, an estate or a van with bonnet, cabin, windows and round wheels.
void AddCar(MeshBuilder& mesh, const Eigen::Vector3f& base, float yaw_rad, Rng& rng);

/// In mid-stride.
void AddPerson(MeshBuilder& mesh, const Eigen::Vector3f& base, float yaw_rad, Rng& rng);

/// A post with a plate at its top.
void AddRoadSign(MeshBuilder& mesh, const Eigen::Vector3f& base, float yaw_rad);

void AddLitterBin(MeshBuilder& mesh, const Eigen::Vector3f& base);

/// A roof on posts with a rear and a side pane and a bench.
void AddBusShelter(MeshBuilder& mesh, const Eigen::Vector3f& base, float yaw_rad);

}  // namespace covsplat
