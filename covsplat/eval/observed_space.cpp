#include "covsplat/eval/observed_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kGrain = 4096;

/// The true pose at the time of a point; neighbours in a scan mostly share it.
class PoseCache {
 public:
  PoseCache(const Trajectory& truth, double max_gap_s) : truth_(truth), max_gap_s_(max_gap_s) {}

  /// Null where there is none; until the next call.
  const SE3* At(double stamp_s) {
    if (stamp_s != stamp_s_) {
      stamp_s_ = stamp_s;
      const auto pose = PoseAt(truth_, stamp_s, max_gap_s_);
      known_ = pose.has_value();
      if (known_) pose_ = *pose;
    }
    return known_ ? &pose_ : nullptr;
  }

 private:
  const Trajectory& truth_;
  double max_gap_s_;
  double stamp_s_ = std::numeric_limits<double>::quiet_NaN();
  bool known_ = false;
  SE3 pose_;
};

/// A cell and those up to `reach` cells away along each axis, nearest first: these answer soonest.
std::vector<Eigen::Vector3i> CellsAround(int reach) {
  std::vector<Eigen::Vector3i> cells;
  for (int x = -reach; x <= reach; ++x) {
    for (int y = -reach; y <= reach; ++y) {
      for (int z = -reach; z <= reach; ++z) cells.emplace_back(x, y, z);
    }
  }
  std::stable_sort(cells.begin(), cells.end(), [](const auto& a, const auto& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  return cells;
}

template <class Test>
std::vector<std::uint8_t> MaskOf(std::span<const Eigen::Vector3d> points,
                                 const VoxelGrid& grid,
                                 ThreadPool& pool,
                                 Test&& test) {
  std::vector<std::uint8_t> mask(points.size(), 0);
  ParallelFor(pool, points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto key = grid.KeyOf(points[i]);
      if (key) mask[i] = test(points[i], VoxelGrid::CellOf(*key)) ? 1 : 0;
    }
  });
  return mask;
}

}  // namespace

ObservedSpace::ObservedSpace(const ObservedSpaceOptions& options)
    : options_(options), return_grid_{0.5 * options.near_m}, space_grid_{options.space_m} {
  COVSPLAT_CHECK(options.near_m > 0.0 && options.space_m > 0.0);
}

std::size_t ObservedSpace::Add(const Scan& scan, const Trajectory& truth) {
  PoseCache poses(truth, options_.max_gap_s);
  VoxelIndex ends;
  std::size_t used = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.points[i].cast<double>();
    if (!point.allFinite() || point.isZero(0.0)) continue;
    const double offset = scan.time_offset_s.empty() ? 0.0 : double{scan.time_offset_s[i]};
    const SE3* T_world_sensor = poses.At(scan.stamp_s + offset);
    if (T_world_sensor == nullptr) continue;
    const Eigen::Vector3d in_world = *T_world_sensor * point;
    const auto cell = return_grid_.KeyOf(in_world);
    const auto end = space_grid_.KeyOf(in_world);
    if (!cell || !end) continue;
    returns_.Insert(*cell);
    ends.Insert(*end);
    ++used;
  }
  const auto origin = PoseAt(truth, scan.stamp_s, options_.max_gap_s);
  for (const std::uint64_t end : ends.Keys()) {
    if (origin) AddRay(origin->Translation(), end);
    space_.Insert(end);
  }
  return used;
}

// Walks in steps of half an edge, which may cut a corner of a cell; its neighbours count anyway.
void ObservedSpace::AddRay(const Eigen::Vector3d& origin, std::uint64_t end) {
  const Eigen::Vector3d way = space_grid_.CenterOf(end) - origin;
  const int steps = static_cast<int>(std::ceil(2.0 * way.norm() / options_.space_m));
  std::optional<std::uint64_t> last;
  for (int k = 0; k < steps; ++k) {
    const auto key = space_grid_.KeyOf(origin + way * (static_cast<double>(k) / steps));
    if (key && key != last) space_.Insert(*key);
    last = key;
  }
}

std::vector<std::uint8_t> ObservedSpace::Visible(std::span<const Eigen::Vector3d> points,
                                                 ThreadPool& pool) const {
  const std::vector<Eigen::Vector3i> around = CellsAround(2);  // farther centres are too far
  return MaskOf(points, return_grid_, pool, [&](const Eigen::Vector3d& p, const auto& cell) {
    for (const Eigen::Vector3i& offset : around) {
      const std::uint64_t key = VoxelGrid::KeyOfCell(cell + offset);
      const double squared_m2 = (return_grid_.CenterOf(key) - p).squaredNorm();
      if (squared_m2 > options_.near_m * options_.near_m) continue;
      if (returns_.Contains(key)) return true;
    }
    return false;
  });
}

std::vector<std::uint8_t> ObservedSpace::InObservedSpace(std::span<const Eigen::Vector3d> points,
                                                         ThreadPool& pool) const {
  const std::vector<Eigen::Vector3i> around = CellsAround(1);
  return MaskOf(points, space_grid_, pool, [&](const Eigen::Vector3d&, const auto& cell) {
    for (const Eigen::Vector3i& offset : around) {
      if (space_.Contains(VoxelGrid::KeyOfCell(cell + offset))) return true;
    }
    return false;
  });
}

}  // namespace covsplat
