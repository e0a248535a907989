// Things that move through a simulated world.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/rng.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/path.hpp"
#include "covsplat/sim/scene.hpp"

namespace covsplat {

/// Classes of points, numbered as in SemanticKITTI.
enum class PointLabel : std::uint32_t { kStatic = 0, kMovingCar = 252, kMovingPerson = 254 };

/// A rigid shape and where it is at any time.
struct Mover {
  std::shared_ptr<const Scene> shape;  ///< in its own frame: x forward, z up, on the ground
  Eigen::Vector3f centre;              ///< of a sphere round the shape, in its own frame
  float radius_m = 0.0f;
  PointLabel label = PointLabel::kStatic;
  Motion motion;  ///< T_world_mover
};

Mover MakeMover(std::shared_ptr<const Scene> shape, PointLabel label, Motion motion);

/// Round and round a closed path at one speed from `start_m` on, never resting.
Motion Circling(std::shared_ptr<const Path> path,
                std::function<double(double, double)> ground,
                double start_m,
                double speed_mps);

/// Shapes in their own frames, resting on z = 0, facing x.
WorldMesh CarShape(Rng& rng);
WorldMesh PersonShape(Rng& rng);

}  // namespace covsplat
