#include "covsplat/mesh/fusion.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
namespace {

/// What a view has to say to every voxel of the field.
struct FusionJob {
  const ViewCamera* camera;
  const DepthView* view;
  const Image<Eigen::Vector3f>* rays;
  Eigen::Matrix3f R_map_view;
  float voxel_m;
  float truncation_m;
  float behind_m;  ///< depth behind a surface that still counts
  float max_range_m;
};

/// Falls behind the surface from one voxel deep down to nothing at the depth that still counts: the
/// far side of a thin wall is for views of that side.
float WeightBehind(float distance_m, const FusionJob& job) {
  if (distance_m > -job.voxel_m) return 1.0f;
  return std::max(0.0f, (job.behind_m + distance_m) / (job.behind_m - job.voxel_m));
}

void FuseVoxel(const FusionJob& job, const Eigen::Vector3f& p_view, Voxel& voxel) {
  const float range = p_view.norm();
  const int index = job.camera->Project(p_view, range);
  if (index < 0) return;
  const auto i = static_cast<std::size_t>(index);
  const DepthPixel& pixel = job.view->pixels.Pixels()[i];
  if (!(pixel.weight > 0.0f)) return;
  const float in_front = pixel.range_m - range;
  // Beyond this the plane says nothing of the place, however flat it is seen.
  const float reach = 2.0f * job.truncation_m;
  if (std::abs(in_front) > reach) return;
  float distance = pixel.normal.dot(p_view - pixel.range_m * job.rays->Pixels()[i]);
  if (distance <= -job.behind_m) return;
  distance = std::min(distance, job.truncation_m);
  const float weight = pixel.weight * WeightBehind(distance, job);
  voxel.weight += weight;
  voxel.distance += weight * distance / job.voxel_m;
  if (distance < job.truncation_m) voxel.normal += weight * (job.R_map_view * pixel.normal);
}

void FuseBlock(const FusionJob& job, const BlockIndex& block, std::span<Voxel> voxels) {
  const SE3 T_view_map = job.view->T_map_view.Inverse();
  const double voxel_m = static_cast<double>(job.voxel_m);
  const Eigen::Vector3d corner = kBlockSide * voxel_m * block.cast<double>();
  const Eigen::Vector3f first = (T_view_map * corner).cast<float>();
  const float diagonal = job.voxel_m * kBlockSide * std::sqrt(3.0f);
  if (first.norm() > job.max_range_m + diagonal) return;
  const Eigen::Matrix3f step = job.voxel_m * job.R_map_view.transpose();
  Eigen::Vector3f p_view = first;
  for (int z = 0; z < kBlockSide; ++z) {
    for (int y = 0; y < kBlockSide; ++y) {
      for (int x = 0; x < kBlockSide; ++x) {
        Voxel& voxel = voxels[static_cast<std::size_t>(VoxelInBlock(x, y, z))];
        p_view.noalias() =
            step *
            Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        p_view += first;
        FuseVoxel(job, p_view, voxel);
      }
    }
  }
}

Image<Eigen::Vector3f> RaysOf(const ViewCamera& camera) {
  Image<Eigen::Vector3f> rays(camera.Rows(), camera.Columns(), Eigen::Vector3f::Zero());
  for (int i = 0; i < camera.Rows(); ++i) {
    for (int j = 0; j < camera.Columns(); ++j) rays(i, j) = camera.RayOf(i, j);
  }
  return rays;
}

}  // namespace

void FuseView(const ViewCamera& camera,
              const DepthView& view,
              const MeshConfig& config,
              VoxelGrid& grid,
              ThreadPool& pool) {
  const Image<Eigen::Vector3f> rays = RaysOf(camera);
  FusionJob job;
  job.camera = &camera;
  job.view = &view;
  job.rays = &rays;
  job.R_map_view = view.T_map_view.RotationMatrix().cast<float>();
  job.voxel_m = static_cast<float>(grid.VoxelSize());
  job.truncation_m = static_cast<float>(config.truncation_voxels * grid.VoxelSize());
  job.behind_m = static_cast<float>(kBehindShare) * job.truncation_m;
  job.max_range_m = static_cast<float>(config.view.max_range_m);
  ParallelFor(pool, grid.Size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) FuseBlock(job, grid.Block(i), grid.Voxels(i));
  });
}

}  // namespace covsplat
