// Scene: a world that rays can be cast into.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <Eigen/Core>

#include "covsplat/sim/mesh_builder.hpp"

namespace covsplat {

/// Triangles under a ray-tracing index (Embree, single precision). Const members may be called from
/// any number of threads. Everything is in the world frame.
class Scene {
 public:
  struct Hit {
    float range_m = 0.0f;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, on the side of the ray's origin
    float reflectivity = 0.0f;
    std::uint32_t triangle = 0;  ///< index into Mesh().triangles
  };

  explicit Scene(WorldMesh mesh);
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  const WorldMesh& Mesh() const;

  /// First surface along a ray, if one is nearer than `max_range_m`; `direction` is a unit vector.
  std::optional<Hit> Cast(const Eigen::Vector3f& origin,
                          const Eigen::Vector3f& direction,
                          float max_range_m) const;

  /// Distance in metres from a point to the nearest surface, if within `max_distance_m`.
  std::optional<float> DistanceTo(const Eigen::Vector3f& point, float max_distance_m) const;

 private:
  struct Index;
  std::unique_ptr<const Index> index_;
};

}  // namespace covsplat
