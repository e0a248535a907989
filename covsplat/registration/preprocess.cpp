#include "covsplat/registration/preprocess.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/Geometry>

#include "covsplat/core/check.hpp"
#include "covsplat/registration/symmetric_eigen.hpp"
#include "covsplat/registration/voxel_moments.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kGrain = 1024;

// Indices of the usable points; counts the others.
std::vector<int> SelectUsable(const Scan& scan,
                              const PreprocessConfig& config,
                              SourceCloud& cloud) {
  const auto min_squared = static_cast<float>(config.min_range_m * config.min_range_m);
  const auto max_squared = static_cast<float>(config.max_range_m * config.max_range_m);
  std::vector<int> usable;
  usable.reserve(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const float squared = scan.points[i].squaredNorm();
    if (squared > min_squared && squared < max_squared) {
      usable.push_back(static_cast<int>(i));
    } else if (std::isfinite(squared)) {
      ++cloud.out_of_range;
    } else {
      ++cloud.not_finite;
    }
  }
  return usable;
}

VoxelMoments Downsample(std::span<const Eigen::Vector4f> points, const PreprocessConfig& config) {
  constexpr int kMaxHalvings = 2;
  const auto enough = static_cast<std::size_t>(config.min_points);
  auto voxel_m = static_cast<float>(config.downsample_voxel_m);
  VoxelMoments voxels(points, voxel_m);
  for (int k = 0; k < kMaxHalvings && voxels.Size() < std::min(enough, points.size()); ++k) {
    voxel_m *= 0.5f;
    voxels = VoxelMoments(points, voxel_m);
  }
  return voxels;
}

// Columns along descending variance, in the point's own frame, the last one facing the sensor.
PointCovariance DescribeSurface(const SymmetricEigen& surface_mid,
                                const Eigen::Matrix3f& R_mid_point,
                                const Eigen::Vector3f& point) {
  Eigen::Matrix3f axes = R_mid_point.transpose() * surface_mid.vectors.cast<float>();
  if (axes.col(2).dot(point) > 0.0f) axes.rightCols<2>() *= -1.0f;
  return {axes, surface_mid.values.cwiseMax(0.0).cwiseSqrt().cast<float>()};
}

}  // namespace

SourceCloud Preprocess(const Scan& scan,
                       const ScanTiming& timing,
                       const ScanMotion& predicted,
                       const PreprocessConfig& config,
                       ThreadPool& pool) {
  COVSPLAT_CHECK(timing.phase.empty() || timing.phase.size() == scan.points.size());
  SourceCloud cloud;
  cloud.duration_s = timing.duration_s;
  cloud.scan_points = scan.points.size();
  const std::vector<int> usable = SelectUsable(scan, config, cloud);

  const auto phase_of = [&](int i) {
    return timing.phase.empty() ? 0.0f : timing.phase[static_cast<std::size_t>(i)];
  };
  const PoseTable poses(timing.phase.empty() ? ScanMotion{} : predicted,
                        Eigen::Matrix3d::Identity());
  std::vector<Eigen::Vector4f> deskewed(usable.size());
  ParallelFor(pool, usable.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      deskewed[k] =
          poses.Move(phase_of(usable[k]), scan.points[static_cast<std::size_t>(usable[k])]);
    }
  });

  const VoxelMoments voxels = Downsample(deskewed, config);
  const std::size_t n = std::min(voxels.Size(), static_cast<std::size_t>(config.max_points));
  cloud.points.resize(n);
  cloud.phase.resize(n);
  cloud.scan_index.resize(n);
  cloud.covariance.resize(n);
  ParallelFor(pool, n, kGrain / 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t voxel = i * voxels.Size() / n;
      const int index = usable[static_cast<std::size_t>(voxels.Representative(voxel))];
      cloud.scan_index[i] = index;
      cloud.points[i] = scan.points[static_cast<std::size_t>(index)];
      cloud.phase[i] = phase_of(index);
      cloud.covariance[i] =
          DescribeSurface(voxels.SurfaceAround(voxel, config.covariance_neighbours),
                          poses.At(cloud.phase[i]).rotation,
                          cloud.points[i]);
    }
  });
  return cloud;
}

}  // namespace covsplat
