// WorldSnapshot: a world with all that moves in it, at one instant.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/sim/mover.hpp"
#include "covsplat/sim/scene.hpp"

namespace covsplat {

/// Refers to its parts, which must outlive it.
struct World {
  const Scene& scene;
  std::span<const Mover> movers;
};

/// Of one instant and one viewpoint. For one thread.
class WorldSnapshot {
 public:
  struct Hit {
    float range_m = 0.0f;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, on the side of the viewpoint
    float reflectivity = 0.0f;
    PointLabel label = PointLabel::kStatic;
  };

  /// Sees no farther than `reach_m` from `viewpoint`.
  WorldSnapshot(const World& world,
                double time_s,
                const Eigen::Vector3d& viewpoint,
                double reach_m);

  /// The first surface in a direction, a unit vector in the world frame.
  std::optional<Hit> Look(const Eigen::Vector3f& direction) const;

 private:
  // A mover within reach; the viewpoint in its own frame.
  struct Near {
    const Mover* mover;
    Eigen::Matrix3f R_mover_world;
    Eigen::Vector3f viewpoint;
  };

  const Scene& scene_;
  Eigen::Vector3f viewpoint_;
  float reach_m_;
  std::vector<Near> near_;
};

}  // namespace covsplat
