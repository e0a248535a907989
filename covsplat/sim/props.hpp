// Things that stand about in simulated worlds. Each appends itself to a mesh; `base` is the point
// on the ground that it stands on, in the world frame, lengths in metres.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// A trunk with branches and a crown of loose leaves, through which some rays pass.
void AddTree(
    MeshBuilder& mesh, const Eigen::Vector3f& base, float height, float crown_radius, Rng& rng);

/// A hedge: a box full of leaves.
void AddHedge(MeshBuilder& mesh,
              const Eigen::Vector3f& base,
              const Eigen::Vector3f& size,
              float yaw_rad,
              Rng& rng);

/// Seat and back on two legs; the back is on the left of the direction `yaw_rad`.
void AddBench(MeshBuilder& mesh, const Eigen::Vector3f& base, float yaw_rad);

void AddLampPost(MeshBuilder& mesh, const Eigen::Vector3f& base, float height);

void AddBollard(MeshBuilder& mesh, const Eigen::Vector3f& base);

/// Round steps, a basin's rim, a column and a figure on top, about 3.8 m high.
void AddFountain(MeshBuilder& mesh, const Eigen::Vector3f& base);

void AddParkedCar(MeshBuilder& mesh, const Eigen::Vector3f& base, float yaw_rad);

/// Rows of equal windows in a wall; sills stand out of it.
struct WindowGrid {
  float first_u = 2.0f;  ///< left edge of the first window
  float pitch_m = 3.0f;
  int count = 1;
  float width_m = 1.2f;
  float height_m = 1.6f;
  std::vector<float> sills_m;  ///< height of the lower edge, one per row
};

/// The openings of the grid's windows, recessed by 15 to 25 cm. Windows that touch one of `others`
/// are left out.
std::vector<Opening> MakeWindows(const WindowGrid& grid,
                                 const std::vector<Opening>& others,
                                 Rng& rng);

/// A cross of glazing bars and a sill for each of the windows.
void AddWindowFrames(MeshBuilder& mesh, const Panel& panel, const std::vector<Opening>& windows);

}  // namespace covsplat
