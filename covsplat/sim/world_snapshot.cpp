#include "covsplat/sim/world_snapshot.hpp"

namespace covsplat {
namespace {

bool MeetsSphere(const Eigen::Vector3f& origin,
                 const Eigen::Vector3f& direction,
                 const Eigen::Vector3f& centre,
                 float radius_m,
                 float max_range_m) {
  const Eigen::Vector3f to_centre = centre - origin;
  const float along = to_centre.dot(direction);
  if (along < -radius_m || along - radius_m > max_range_m) return false;
  return (to_centre - along * direction).squaredNorm() <= radius_m * radius_m;
}

}  // namespace

WorldSnapshot::WorldSnapshot(const World& world,
                             double time_s,
                             const Eigen::Vector3d& viewpoint,
                             double reach_m)
    : scene_(world.scene),
      viewpoint_(viewpoint.cast<float>()),
      reach_m_(static_cast<float>(reach_m)) {
  for (const Mover& mover : world.movers) {
    const SE3 T_mover_world = mover.motion.PoseAt(time_s).Inverse();
    const Eigen::Vector3f seen_from = (T_mover_world * viewpoint).cast<float>();
    if ((seen_from - mover.centre).norm() > reach_m_ + mover.radius_m) continue;
    near_.push_back({&mover, T_mover_world.RotationMatrix().cast<float>(), seen_from});
  }
}

std::optional<WorldSnapshot::Hit> WorldSnapshot::Look(const Eigen::Vector3f& direction) const {
  std::optional<Hit> nearest;
  if (const auto hit = scene_.Cast(viewpoint_, direction, reach_m_)) {
    nearest = Hit{hit->range_m, hit->normal, hit->reflectivity, PointLabel::kStatic};
  }
  for (const Near& near : near_) {
    const Eigen::Vector3f own = near.R_mover_world * direction;
    const float reach_m = nearest ? nearest->range_m : reach_m_;
    const Mover& mover = *near.mover;
    if (!MeetsSphere(near.viewpoint, own, mover.centre, mover.radius_m, reach_m)) continue;
    const auto hit = mover.shape->Cast(near.viewpoint, own, reach_m);
    if (!hit) continue;
    nearest = Hit{
        hit->range_m, near.R_mover_world.transpose() * hit->normal, hit->reflectivity, mover.label};
  }
  return nearest;
}

}  // namespace covsplat
