// WorldMesh and the simple shapes that the simulated worlds are put together from.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat {

/// A triangle soup in the world frame. Triangles have no inside: both sides reflect alike.
struct WorldMesh : TriangleMesh {
  std::vector<float> reflectivity;  ///< [T] diffuse, 0 black to 1 white
};

/// An upright plane with its own coordinates, for walls: `u` metres along it, `z` up in the world,
/// `depth` metres behind its face (negative stands out of it).
struct Panel {
  Eigen::Vector3f origin;   ///< u = 0, z = 0, depth = 0
  Eigen::Vector3f along;    ///< unit, horizontal
  Eigen::Vector3f outward;  ///< unit, horizontal, normal of the face

  Eigen::Vector3f At(float u, float z, float depth = 0.0f) const {
    return origin + u * along + z * Eigen::Vector3f::UnitZ() - depth * outward;
  }
};

/// A rectangular hole in a panel, with side walls `depth` deep and, unless it leads through, a
/// back. With depth 0 it is nothing but a hole.
struct Opening {
  float u_low = 0.0f;
  float u_high = 0.0f;
  float z_low = 0.0f;
  float z_high = 0.0f;
  float depth = 0.2f;
  bool through = false;
  float back_reflectivity = 0.1f;
};

/// Appends shapes to a mesh; lengths in metres, positions in the world frame.
class MeshBuilder {
 public:
  void Facet(const Eigen::Vector3f& a,
             const Eigen::Vector3f& b,
             const Eigen::Vector3f& c,
             float reflectivity);

  /// Corners in order round the edge.
  void Quad(const Eigen::Vector3f& a,
            const Eigen::Vector3f& b,
            const Eigen::Vector3f& c,
            const Eigen::Vector3f& d,
            float reflectivity);

  /// Stands on `base`, the centre of its bottom, turned about the vertical.
  void Box(const Eigen::Vector3f& base,
           const Eigen::Vector3f& size,
           float yaw_rad,
           float reflectivity);

  /// Upright, from `base` up, closed on top; different radii make a cone or its frustum.
  void Cylinder(const Eigen::Vector3f& base,
                float bottom_radius,
                float top_radius,
                float height,
                int sides,
                float reflectivity);

  /// An icosphere with 20 * 4^subdivisions faces, stretched to `radii`.
  void Ellipsoid(const Eigen::Vector3f& centre,
                 const Eigen::Vector3f& radii,
                 int subdivisions,
                 float reflectivity);

  /// The surface z = height(x, y) over [low, high], in cells of at most `cell_m`.
  void HeightField(const Eigen::Vector2f& low,
                   const Eigen::Vector2f& high,
                   float cell_m,
                   const std::function<float(float, float)>& height,
                   const std::function<float(float, float)>& reflectivity);

  /// A wall over [0, width] x [z_low, z_high] of a panel with openings that do not overlap.
  void Wall(const Panel& panel,
            float width,
            float z_low,
            float z_high,
            const std::vector<Opening>& openings,
            float reflectivity);

  /// The wall above one arch: a half circle over [u_low, u_high] that springs at `spring_m`, filled
  /// up to `top_m`, with a soffit `thickness` deep and a rear face.
  void Arch(const Panel& panel,
            float u_low,
            float u_high,
            float spring_m,
            float top_m,
            float thickness,
            float reflectivity);

  WorldMesh Take() && { return std::move(mesh_); }

 private:
  int Vertex(const Eigen::Vector3f& position);
  void Triangle(int a, int b, int c, float reflectivity);
  void Recess(const Panel& panel, const Opening& opening, float reflectivity);

  WorldMesh mesh_;
};

}  // namespace covsplat
