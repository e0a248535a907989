// Parts of buildings that several simulated worlds share.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/mesh_builder.hpp"
#include "covsplat/sim/props.hpp"

namespace covsplat {

/// A rectangle of a panel that begins at u = 0; heights count from the panel's origin.
struct WallSize {
  float width = 0.0f;
  float z_low = 0.0f;
  float z_high = 0.0f;
};

/// A closed door, 45 cm behind the face.
Opening Door(float u, float width, float z, float height);

/// A wall with doors and, between them, windows.
void AddFacade(MeshBuilder& mesh,
               const Panel& panel,
               const WallSize& size,
               const std::vector<Opening>& doors,
               const WindowGrid& grid,
               float reflectivity,
               Rng& rng);

/// Rises by `rise` over `run` behind the top of a wall, with eaves 0.5 m in front of it.
void AddRoof(
    MeshBuilder& mesh, const Panel& panel, float width, float eaves, float run, float rise);

/// The panel `depth` metres behind another, seen from its rear, with u running the other way from
/// `width`.
Panel RearOf(const Panel& panel, float width, float depth);

/// The face of a wall towards a room: openings of the front lead through as plain holes.
void AddRearFace(MeshBuilder& mesh,
                 const Panel& panel,
                 const WallSize& size,
                 float thickness,
                 const std::vector<Opening>& passages,
                 float reflectivity);

/// A house of a terrace: facade, flanks, gable roof, cornice, chimney and a step at its door. Its
/// front is `width` wide on the panel.
void AddHouse(MeshBuilder& mesh, const Panel& panel, float width, float depth, Rng& rng);

/// Houses of all kinds side by side over [0, length] of a panel, some set back behind a hedge.
void AddHouseRow(MeshBuilder& mesh, const Panel& panel, float length, float depth, Rng& rng);

/// Rises along the panel's `along` from u = 0, on the side the panel faces: steps with a string
/// wall on that outer side. Each step is `thickness` thick, or solid to the ground if that is 0.
struct Stairs {
  int steps = 10;
  float rise = 0.17f;
  float run = 0.30f;
  float width = 1.8f;
  float thickness = 0.0f;
};
void AddStairs(MeshBuilder& mesh, const Panel& panel, const Stairs& stairs, float reflectivity);

/// Balusters under a hand rail from one point of the floor to another.
void AddRailing(MeshBuilder& mesh,
                const Eigen::Vector3f& from,
                const Eigen::Vector3f& to,
                float height,
                float reflectivity);

}  // namespace covsplat
