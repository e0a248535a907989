#include "covsplat/loops/stitch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "covsplat/registration/nearest_index.hpp"

namespace covsplat {
namespace {

constexpr int kNone = -1;

/// Surfels in the map, one by one as they were given.
struct MapSurfels {
  std::vector<Eigen::Vector3f> mean;
  std::vector<Eigen::Vector3f> normal;
};

MapSurfels InMap(std::span<const AnchoredSurfel> surfels, std::span<const SE3> T_map_keyframe) {
  MapSurfels in_map;
  for (const AnchoredSurfel& surfel : surfels) {
    const SE3& pose = T_map_keyframe[static_cast<std::size_t>(surfel.keyframe)];
    in_map.mean.push_back((pose * surfel.mean.cast<double>()).cast<float>());
    in_map.normal.push_back((pose.Rotation() * surfel.normal.cast<double>()).cast<float>());
  }
  return in_map;
}

/// Of each surfel the nearest one of another pass.
std::vector<int> MatchPasses(std::span<const AnchoredSurfel> surfels,
                             const MapSurfels& in_map,
                             std::span<const double> way_m,
                             double min_way_m,
                             const StitchConfig& config,
                             ThreadPool& pool) {
  const NearestIndex index(in_map.mean, static_cast<float>(config.gate_m));
  const auto gate = static_cast<float>(config.gate_m * config.gate_m);
  const auto min_cosine =
      static_cast<float>(std::cos(config.max_angle_deg * std::numbers::pi / 180.0));
  const auto way_of = [&](std::size_t i) {
    return way_m[static_cast<std::size_t>(surfels[i].keyframe)];
  };
  std::vector<int> match(surfels.size(), kNone);
  ParallelFor(pool, surfels.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float nearest = gate;
      index.ForEachAround(in_map.mean[i], [&](std::size_t j) {
        const float square = (in_map.mean[j] - in_map.mean[i]).squaredNorm();
        if (square >= nearest || std::abs(way_of(i) - way_of(j)) < min_way_m) return;
        if (in_map.normal[j].dot(in_map.normal[i]) < min_cosine) return;
        nearest = square;
        match[i] = static_cast<int>(j);
      });
    }
  });
  return match;
}

/// Normal equations of the pose of one keyframe as another one sees it.
struct Tie {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  int pairs = 0;
};

/// Point to plane: the residual is <n, T_from_to p - q>, by a right perturbation of T_from_to.
void AddPair(const AnchoredSurfel& point,
             const AnchoredSurfel& plane,
             const SE3& T_plane_point,
             const StitchConfig& config,
             Tie& tie) {
  const Eigen::Vector3d p = point.mean.cast<double>();
  const Eigen::Vector3d normal = plane.normal.cast<double>();
  const double error_m = normal.dot(T_plane_point * p - plane.mean.cast<double>());
  const Eigen::Vector3d turned = T_plane_point.Rotation().conjugate() * normal;
  Vector6d slope;
  slope << p.cross(turned), turned;
  const double square = error_m * error_m / (config.sigma_m * config.sigma_m);
  const double kernel = 1.0 / ((1.0 + square / 9.0) * (1.0 + square / 9.0));
  const double weight = kernel / (config.sigma_m * config.sigma_m * config.pairs_per_measurement);
  tie.hessian += weight * slope * slope.transpose();
  tie.gradient += weight * error_m * slope;
  ++tie.pairs;
}

}  // namespace

std::vector<PoseEdge> StitchEdges(std::span<const AnchoredSurfel> surfels,
                                  std::span<const SE3> T_map_keyframe,
                                  std::span<const double> way_m,
                                  double min_way_m,
                                  const StitchConfig& config,
                                  ThreadPool& pool) {
  const MapSurfels in_map = InMap(surfels, T_map_keyframe);
  const std::vector<int> match = MatchPasses(surfels, in_map, way_m, min_way_m, config, pool);
  const auto T_between = [&](int from, int to) {
    return T_map_keyframe[static_cast<std::size_t>(from)].Inverse() *
           T_map_keyframe[static_cast<std::size_t>(to)];
  };
  std::map<std::pair<int, int>, Tie> ties;  // of (plane's, point's) keyframe
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (match[i] == kNone) continue;
    const AnchoredSurfel& plane = surfels[static_cast<std::size_t>(match[i])];
    const std::pair<int, int> keyframes(plane.keyframe, surfels[i].keyframe);
    AddPair(
        surfels[i], plane, T_between(plane.keyframe, surfels[i].keyframe), config, ties[keyframes]);
  }
  std::vector<PoseEdge> edges;
  for (const auto& [keyframes, tie] : ties) {
    if (tie.pairs < config.min_pairs) continue;
    // Directions that no pair tells of stay as they are.
    Matrix6d damped = tie.hessian;
    damped.diagonal().array() += 1e-6 * tie.hessian.diagonal().maxCoeff();
    const Vector6d step = -damped.ldlt().solve(tie.gradient);
    edges.push_back({keyframes.first,
                     keyframes.second,
                     T_between(keyframes.first, keyframes.second) * SE3::Exp(step),
                     tie.hessian});
  }
  return edges;
}

}  // namespace covsplat
