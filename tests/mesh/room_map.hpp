// Maps whose surface is known: Gaussians that tile walls.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "covsplat/mesh/surfel_map.hpp"

namespace covsplat::test {

using Vector = Eigen::Vector3d;

constexpr double kSpacing = 0.1;

inline SE3 At(double x, double y, double z) {
  return {Eigen::Quaterniond::Identity(), Vector(x, y, z)};
}

struct Disc {
  Vector mean;
  Vector normal;
};

/// Fills the rectangle of `centre` +- `u` +- `v` with discs that face the side of u x v.
inline void Tile(const Vector& centre, const Vector& u, const Vector& v, std::vector<Disc>& discs) {
  const int columns = static_cast<int>(std::round(2.0 * u.norm() / kSpacing));
  const int rows = static_cast<int>(std::round(2.0 * v.norm() / kSpacing));
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      discs.push_back(
          {centre + u * ((2.0 * i + 1.0) / columns - 1.0) + v * ((2.0 * j + 1.0) / rows - 1.0),
           u.cross(v).normalized()});
    }
  }
}

inline SurfelMap MapOf(const std::vector<Disc>& discs, std::vector<SE3> keyframes) {
  SurfelMap map;
  map.T_map_keyframe = std::move(keyframes);
  map.gaussians.Resize(discs.size());
  map.keyframe.assign(discs.size(), 0);
  map.confidence.assign(discs.size(), 1.0f);
  map.intensity.assign(discs.size(), 0.0f);
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const auto q = Eigen::Quaterniond::FromTwoVectors(Vector::UnitZ(), discs[i].normal);
    const auto log_scale = static_cast<float>(std::log(0.6 * kSpacing));
    WriteGaussian(map.gaussians,
                  i,
                  discs[i].mean.cast<float>(),
                  q.cast<float>(),
                  {log_scale, log_scale},
                  3.0f);
  }
  return map;
}

/// The inside of a box of 4 x 3 x 2 m.
inline std::vector<Disc> Room() {
  std::vector<Disc> discs;
  const Vector x(2.0, 0.0, 0.0), y(0.0, 1.5, 0.0), z(0.0, 0.0, 1.0);
  Tile(-x, y, z, discs);
  Tile(x, z, y, discs);
  Tile(-y, z, x, discs);
  Tile(y, x, z, discs);
  Tile(-z, x, y, discs);
  Tile(z, y, x, discs);
  return discs;
}

inline double DistanceToRoom(const Vector& p) {
  const Vector q = p.cwiseAbs() - Vector(2.0, 1.5, 1.0);
  return q.maxCoeff() <= 0.0 ? -q.maxCoeff() : q.cwiseMax(0.0).norm();
}

inline SurfelMap RoomMap() {
  return MapOf(Room(), {At(0.0, 0.0, 0.0), At(1.0, 0.4, 0.2), At(-1.0, -0.5, -0.2)});
}

}  // namespace covsplat::test
