#include "covsplat/loops/local_map.hpp"

#include <Eigen/Geometry>

#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {
namespace {

/// Any axes with this normal.
Eigen::Matrix3f AxesOf(const Eigen::Vector3f& normal) {
  Eigen::Matrix3f axes;
  axes.col(2) = normal;
  axes.col(0) = normal.unitOrthogonal();
  axes.col(1) = normal.cross(axes.col(0));
  return axes;
}

/// Neighbourhoods that are lines or clouds have normals that mean nothing.
bool IsFlat(const PointCovariance& covariance) {
  const Eigen::Vector3f& sigma_m = covariance.sigma_m;
  return sigma_m[1] >= 0.5f * sigma_m[0] && sigma_m[2] <= 0.2f * sigma_m[1];
}

struct LocalPoint {
  Eigen::Vector3f point;
  Eigen::Vector3f normal;
};

std::vector<LocalPoint> Gather(const LocalMap& map, double voxel_m, bool only_flat) {
  VoxelHash taken;
  std::vector<LocalPoint> points;
  for (const PosedPlace& posed : map) {
    const Eigen::Matrix3f rotation = posed.T_local_place.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = posed.T_local_place.Translation().cast<float>();
    for (const PlacePoint& seen : posed.place->points) {
      if (only_flat && !seen.IsFlat()) continue;
      const Eigen::Vector3f point = rotation * seen.Position() + translation;
      const auto fresh = static_cast<int>(points.size());
      if (taken.FindOrInsert(CellOf(point / static_cast<float>(voxel_m)), fresh) != fresh) continue;
      points.push_back({point, rotation * seen.Normal()});
    }
  }
  return points;
}

}  // namespace

PlacePoint::PlacePoint(const Eigen::Vector3f& position_m, const Eigen::Vector3f& normal)
    : position_((position_m / kStepM).array().round().cast<std::int16_t>()),
      normal_((127.0f * normal).array().round().cast<std::int8_t>()) {}

Place MakePlace(int keyframe,
                std::span<const Eigen::Vector3f> points,
                std::span<const Eigen::Vector3f> surface,
                std::span<const PointCovariance> covariance,
                double voxel_m) {
  Place place{keyframe, {}, Sight(points)};
  VoxelHash taken;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    if (!(surface[i].cwiseAbs().maxCoeff() <= PlacePoint::kFarthestM)) continue;
    const auto fresh = static_cast<int>(place.points.size());
    const Eigen::Vector3i cell = CellOf(surface[i] / static_cast<float>(voxel_m));
    if (taken.FindOrInsert(cell, fresh) != fresh) continue;
    const Eigen::Vector3f normal = covariance[i].axes.col(2);
    place.points.emplace_back(surface[i], IsFlat(covariance[i]) ? normal : Eigen::Vector3f::Zero());
  }
  return place;
}

std::vector<Eigen::Vector3f> PointsOf(const LocalMap& map, double voxel_m) {
  std::vector<Eigen::Vector3f> points;
  for (const LocalPoint& p : Gather(map, voxel_m, false)) points.push_back(p.point);
  return points;
}

SourceCloud SourceOf(const LocalMap& map, double voxel_m) {
  SourceCloud source;
  for (const LocalPoint& p : Gather(map, voxel_m, true)) {
    source.scan_index.push_back(static_cast<int>(source.points.size()));
    source.points.push_back(p.point);
    source.covariance.push_back({AxesOf(p.normal), Eigen::Vector3f(1.0f, 1.0f, 0.0f)});
  }
  source.phase.assign(source.points.size(), 0.0f);
  source.scan_points = source.points.size();
  return source;
}

RegistrationTarget TargetOf(const LocalMap& map, double voxel_m) {
  std::vector<TargetSurfel> surfels;
  for (const LocalPoint& p : Gather(map, voxel_m, true)) {
    surfels.push_back({.mean = p.point, .rotation = Eigen::Quaternionf(AxesOf(p.normal))});
  }
  return {surfels, Eigen::Vector3d::Zero(), 0};
}

double SeenThroughShare(const LocalMap& map, const LocalMap& by, const SE3& T_by_map) {
  std::size_t through = 0;
  std::size_t there = 0;
  for (const PosedPlace& seeing : by) {
    for (const PosedPlace& seen : map) {
      const SE3 T_seeing_seen = seeing.T_local_place.Inverse() * T_by_map * seen.T_local_place;
      const Eigen::Matrix3f rotation = T_seeing_seen.RotationMatrix().cast<float>();
      const Eigen::Vector3f translation = T_seeing_seen.Translation().cast<float>();
      for (const PlacePoint& point : seen.place->points) {
        const Seen what = seeing.place->sight.See(rotation * point.Position() + translation);
        through += what == Seen::kThrough ? 1 : 0;
        there += what == Seen::kThere ? 1 : 0;
      }
    }
  }
  if (through + there == 0) return 0.0;
  return static_cast<double>(through) / static_cast<double>(through + there);
}

}  // namespace covsplat
