#include "covsplat/registration/voxel_moments.hpp"

#include <algorithm>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

// Measurements a voxel may contribute as. Near the sensor voxels hold hundreds of points; without a
// limit they would pull the fit to the nearest rings.
constexpr float kCountLimit = 12.0f;

Eigen::Matrix3d Unpack(const Eigen::Matrix<double, 6, 1>& v) {
  Eigen::Matrix3d m;
  m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
  return m;
}

Eigen::Matrix<float, 6, 1> OuterProduct(const Eigen::Vector3f& v) {
  Eigen::Matrix<float, 6, 1> p;
  p << v.x() * v.x(), v.x() * v.y(), v.x() * v.z(), v.y() * v.y(), v.y() * v.z(), v.z() * v.z();
  return p;
}

}  // namespace

struct VoxelMoments::Neighbourhood {
  double measurements = 0.0;
  int voxels = 0;
  double weight = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 1> squares = Eigen::Matrix<double, 6, 1>::Zero();

  Eigen::Matrix3d Covariance() const {
    const Eigen::Vector3d mean = sum / weight;
    return Unpack(squares / weight) - mean * mean.transpose();
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
    Voxel& voxel = voxels_[static_cast<std::size_t>(at)];
    const Eigen::Vector3f offset =
        points[i] - (cell.cast<float>().array() + 0.5f).matrix() * voxel_m;
    voxel.count += 1.0f;
    voxel.sum += offset;
    voxel.squares += OuterProduct(offset);
    const float squared = offset.squaredNorm();
    if (voxel.representative >= 0 && squared >= voxel.squared_to_centre) continue;
    voxel.representative = static_cast<int>(i);
    voxel.squared_to_centre = squared;
  }
}

VoxelMoments::Neighbourhood VoxelMoments::Gather(const Voxel& centre, int radius) const {
  Neighbourhood merged;
  for (int dx = -radius; dx <= radius; ++dx) {
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dz = -radius; dz <= radius; ++dz) {
        const int at = cells_.Find(centre.cell + Eigen::Vector3i(dx, dy, dz));
        if (at < 0) continue;
        const Voxel& voxel = voxels_[static_cast<std::size_t>(at)];
        const float scale = std::min(1.0f, kCountLimit / voxel.count);
        // From the voxel's centre to the central voxel's centre.
        const Eigen::Vector3f shift = Eigen::Vector3i(dx, dy, dz).cast<float>() * voxel_m_;
        const Eigen::Vector3f mean = voxel.sum / voxel.count;
        const Eigen::Matrix<float, 6, 1> spread = voxel.squares - voxel.count * OuterProduct(mean);
        merged.measurements += voxel.count;
        ++merged.voxels;
        merged.weight += scale * voxel.count;
        merged.sum += (scale * voxel.count * (mean + shift)).cast<double>();
        merged.squares +=
            (scale * (spread + voxel.count * OuterProduct(mean + shift))).cast<double>();
      }
    }
  }
  return merged;
}

Eigen::Matrix3d VoxelMoments::CovarianceAround(std::size_t voxel, int min_points) const {
  constexpr int kMinVoxels = 4;
  constexpr double kMinSpan = 0.03;  // of second to first variance; below it is one scan line
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int radius = 1; radius <= kMaxRadius; ++radius) {
    const Neighbourhood merged = Gather(voxels_[voxel], radius);
    covariance = merged.Covariance();
    if (merged.measurements < min_points || merged.voxels < kMinVoxels) continue;
    // Second over first variance is at least the ratio of the sum of principal minors to trace^2.
    const double trace = covariance.trace();
    const double minors = 0.5 * (trace * trace - covariance.squaredNorm());
    if (minors > kMinSpan * trace * trace) break;
  }
  return covariance;
}

}  // namespace covsplat
