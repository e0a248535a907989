#include "covsplat/sim/mover.hpp"

#include <utility>

#include <Eigen/Geometry>

#include "covsplat/sim/street_props.hpp"

namespace covsplat {

using Eigen::Vector3f;

Mover MakeMover(std::shared_ptr<const Scene> shape, PointLabel label, Motion motion) {
  Eigen::AlignedBox3f box;
  for (const Vector3f& vertex : shape->Mesh().vertices) box.extend(vertex);
  Vector3f centre = box.center();
  const float radius_m = 0.5f * box.diagonal().norm();
  return {std::move(shape), std::move(centre), radius_m, label, std::move(motion)};
}

Motion Circling(std::shared_ptr<const Path> path,
                std::function<double(double, double)> ground,
                double start_m,
                double speed_mps) {
  const double lap_s = path->Length() / speed_mps;
  return {lap_s,
          [path = std::move(path), ground = std::move(ground), start_m, speed_mps](double t) {
            const double distance_m = start_m + speed_mps * t;
            Eigen::Vector3d position = path->At(distance_m);
            if (ground) position.z() += ground(position.x(), position.y());
            const Eigen::Quaterniond heading(
                Eigen::AngleAxisd(path->Heading(distance_m), Eigen::Vector3d::UnitZ()));
            return SE3(heading, position);
          }};
}

WorldMesh CarShape(Rng& rng) {
  MeshBuilder mesh;
  AddCar(mesh, Vector3f::Zero(), 0.0f, rng);
  return std::move(mesh).Take();
}

WorldMesh PersonShape(Rng& rng) {
  MeshBuilder mesh;
  AddPerson(mesh, Vector3f::Zero(), 0.0f, rng);
  return std::move(mesh).Take();
}

}  // namespace covsplat
