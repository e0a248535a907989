#include "covsplat/loops/ground.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {
namespace {

constexpr float kCellM = 5.0f;
constexpr int kIterations = 20;
constexpr double kConverged = 1e-4;
/// Lowest points farther from the plane than this are not on the ground; it is narrowed from the
/// first to the last.
constexpr double kFirstGateM = 5.0;
constexpr double kLastGateM = 0.5;

std::vector<Eigen::Vector3d> LowestPoints(std::span<const Eigen::Vector3f> points) {
  VoxelHash cells;
  std::vector<Eigen::Vector3d> lowest;
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector3f flat(point.x(), point.y(), 0.0f);
    const auto fresh = static_cast<int>(lowest.size());
    const int cell = cells.FindOrInsert(CellOf(flat / kCellM), fresh);
    if (cell == fresh) {
      lowest.push_back(point.cast<double>());
    } else if (point.z() < lowest[static_cast<std::size_t>(cell)].z()) {
      lowest[static_cast<std::size_t>(cell)] = point.cast<double>();
    }
  }
  return lowest;
}

}  // namespace

SE3 AlignWithGround(std::span<const Eigen::Vector3f> points) {
  const std::vector<Eigen::Vector3d> lowest = LowestPoints(points);
  SE3 T_ground_local;
  if (lowest.empty()) return T_ground_local;
  std::vector<double> heights;
  heights.reserve(lowest.size());
  for (const Eigen::Vector3d& p : lowest) heights.push_back(p.z());
  std::ranges::nth_element(heights,
                           heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2));
  T_ground_local = SE3(Eigen::Quaterniond::Identity(), {0.0, 0.0, -heights[heights.size() / 2]});
  double gate_m = kFirstGateM;
  for (int i = 0; i < kIterations; ++i) {
    // Turning by roll and pitch and lifting changes z by roll y - pitch x + lift.
    Eigen::Matrix3d hessian = 1e-6 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& local : lowest) {
      const Eigen::Vector3d p = T_ground_local * local;
      if (std::abs(p.z()) > gate_m) continue;
      const Eigen::Vector3d row(p.y(), -p.x(), 1.0);
      hessian += row * row.transpose();
      gradient += p.z() * row;
    }
    const Eigen::Vector3d step = -hessian.ldlt().solve(gradient);
    Vector6d twist = Vector6d::Zero();
    twist[0] = step[0];
    twist[1] = step[1];
    twist[5] = step[2];
    T_ground_local = SE3::Exp(twist) * T_ground_local;
    if (step.norm() < kConverged && gate_m <= kLastGateM) break;
    gate_m = std::max(0.7 * gate_m, kLastGateM);
  }
  return T_ground_local;
}

}  // namespace covsplat
