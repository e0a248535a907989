#include "covsplat/registration/voxel_moments.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

// Measurements a voxel may contribute as. Near the sensor voxels hold hundreds of points; without a
// limit they would pull the fit to the nearest rings.
constexpr float kCountLimit = 12.0f;
// A standard deviation across the surface below this is measurement noise.
constexpr double kFlat_m = 0.04;

Eigen::Matrix3d Unpack(const Eigen::Matrix<float, 6, 1>& v) {
  Eigen::Matrix3f m;
  m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
  return m.cast<double>();
}

Eigen::Matrix<float, 6, 1> OuterProduct(const Eigen::Vector3f& v) {
  Eigen::Matrix<float, 6, 1> p;
  p << v.x() * v.x(), v.x() * v.y(), v.x() * v.z(), v.y() * v.y(), v.y() * v.z(), v.z() * v.z();
  return p;
}

// Second variance in relation to the first; below this it is one scan line.
bool SpansASurface(const SymmetricEigen& eigen) { return eigen.values[1] > 0.03 * eigen.values[0]; }

bool IsFlat(const SymmetricEigen& eigen) { return eigen.values[2] < kFlat_m * kFlat_m; }

}  // namespace

// Through a point relative to the central voxel's centre.
struct VoxelMoments::Plane {
  Eigen::Vector3f normal;
  Eigen::Vector3f point;

  float WeightOf(const Eigen::Vector3f& position) const {
    constexpr float kWidth = 0.05f;  // m
    const float distance = normal.dot(position - point) / kWidth;
    const float fading = 1.0f / (1.0f + distance * distance);
    return fading * fading;
  }
};

// Sums are relative to the central voxel's centre.
struct VoxelMoments::Neighbourhood {
  float measurements = 0.0f;
  int voxels = 0;
  float weight = 0.0f;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Packed squares = Packed::Zero();

  SymmetricEigen Decompose() const {
    const Eigen::Vector3f mean = sum / weight;
    return DecomposeSymmetric(Unpack(squares / weight - OuterProduct(mean)));
  }
};

VoxelMoments::VoxelMoments(std::span<const Eigen::Vector3f> points, float voxel_m)
    : voxel_m_(voxel_m), cells_(points.size()) {
  COVSPLAT_CHECK(voxel_m > 0.0f);
  voxels_.reserve(points.size() / 4);
  const float voxels_per_m = 1.0f / voxel_m;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i cell = CellOf(points[i] * voxels_per_m);
    const int at = cells_.FindOrInsert(cell, static_cast<int>(voxels_.size()));
    if (at == static_cast<int>(voxels_.size())) voxels_.push_back({.cell = cell});
    Add(voxels_[static_cast<std::size_t>(at)], points[i], static_cast<int>(i));
  }
  for (Voxel& voxel : voxels_) {
    voxel.mean /= voxel.count;
    voxel.spread = voxel.spread / voxel.count - OuterProduct(voxel.mean);
  }
}

void VoxelMoments::Add(Voxel& voxel, const Eigen::Vector3f& point, int index) const {
  const Eigen::Vector3f offset =
      point - (voxel.cell.cast<float>().array() + 0.5f).matrix() * voxel_m_;
  voxel.count += 1.0f;
  voxel.mean += offset;
  voxel.spread += OuterProduct(offset);
  const float squared = offset.squaredNorm();
  if (voxel.representative >= 0 && squared >= voxel.squared_to_centre) return;
  voxel.representative = index;
  voxel.squared_to_centre = squared;
}

VoxelMoments::Neighbourhood VoxelMoments::Gather(const Voxel& centre,
                                                 int radius,
                                                 const Plane* plane) const {
  Neighbourhood merged;
  for (int dx = -radius; dx <= radius; ++dx) {
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dz = -radius; dz <= radius; ++dz) {
        const Eigen::Vector3i shift(dx, dy, dz);
        const int at = cells_.Find(centre.cell + shift);
        if (at < 0) continue;
        const Voxel& voxel = voxels_[static_cast<std::size_t>(at)];
        const Eigen::Vector3f mean = voxel.mean + shift.cast<float>() * voxel_m_;
        float weight = std::min(voxel.count, kCountLimit);
        if (plane != nullptr) weight *= plane->WeightOf(mean);
        merged.measurements += voxel.count;
        ++merged.voxels;
        merged.weight += weight;
        merged.sum += weight * mean;
        merged.squares += weight * (voxel.spread + OuterProduct(mean));
      }
    }
  }
  return merged;
}

SymmetricEigen VoxelMoments::SurfaceAround(std::size_t voxel, int min_points) const {
  constexpr int kMinVoxels = 4;
  constexpr float kMinOwnPoints = 6.0f;
  const Voxel& centre = voxels_[voxel];
  SymmetricEigen surface;
  int radius = 1;
  for (;; ++radius) {
    const Neighbourhood merged = Gather(centre, radius, nullptr);
    surface = merged.Decompose();
    if (radius == kMaxRadius) break;
    if (merged.measurements < static_cast<float>(min_points) || merged.voxels < kMinVoxels) {
      continue;
    }
    if (SpansASurface(surface)) break;
  }
  if (IsFlat(surface) || centre.count < kMinOwnPoints) return surface;
  const SymmetricEigen own = DecomposeSymmetric(Unpack(centre.spread));
  if (!IsFlat(own) || !SpansASurface(own)) return surface;
  Plane plane{own.vectors.col(2).cast<float>(), centre.mean};
  for (int pass = 0; pass < 2; ++pass) {
    surface = Gather(centre, radius, &plane).Decompose();
    plane.normal = surface.vectors.col(2).cast<float>();
  }
  return surface;
}

}  // namespace covsplat
