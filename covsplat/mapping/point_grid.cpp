#include "covsplat/mapping/point_grid.hpp"

#include <algorithm>
#include <array>

namespace covsplat {
namespace {

/// More blocks than a sensor's surroundings have; what lies beyond is left out.
constexpr std::size_t kMaxBlocks = std::size_t{1} << 17;

/// The bits of a coordinate, each in every third place.
constexpr std::array<int, 16> kSpread = [] {
  std::array<int, 16> spread{};
  for (int value = 0; value < 16; ++value) {
    for (int bit = 0; bit < 4; ++bit) {
      spread[static_cast<std::size_t>(value)] |= (value >> bit & 1) << 3 * bit;
    }
  }
  return spread;
}();

}  // namespace

void Moments::Add(const Eigen::Vector3d& point,
                  const Eigen::Vector3d& sensor,
                  double its_intensity) {
  count += 1.0;
  sum += point;
  square += point.cwiseAbs2();
  mixed += Eigen::Vector3d(point.x() * point.y(), point.y() * point.z(), point.z() * point.x());
  to_sensor += sensor - point;
  intensity += its_intensity;
}

void Moments::Add(const Moments& other) {
  count += other.count;
  sum += other.sum;
  square += other.square;
  mixed += other.mixed;
  to_sensor += other.to_sensor;
  intensity += other.intensity;
}

Eigen::Matrix3d Moments::Covariance() const {
  Eigen::Matrix3d second;
  second << square.x(), mixed.x(), mixed.z(),  //
      mixed.x(), square.y(), mixed.y(),        //
      mixed.z(), mixed.y(), square.z();
  const Eigen::Vector3d mean = Mean();
  return second / count - mean * mean.transpose();
}

/// All usable points in the frame of the grid, block after block.
struct PointGrid::Sorted {
  struct Point {
    Eigen::Vector3f p_grid;
    int code = 0;
    int scan = 0;
    float intensity = 0.0f;
  };
  std::vector<Eigen::Vector3d> sensor;  ///< [scans] positions in the frame of the grid
  std::vector<Point> points;
  std::vector<std::size_t> begin;  ///< [B + 1]
};

PointGrid::PointGrid(std::span<const PosedPoints> scans,
                     const SensorModel& sensor,
                     double block_m,
                     int levels,
                     ThreadPool& pool)
    : block_m_(block_m),
      levels_(levels),
      finest_per_m_(static_cast<float>(1.0 / CellSize(levels))) {
  if (scans.empty()) return;
  const Eigen::Vector3d here = scans.back().T_map_sensor.Translation();
  const Eigen::Vector3d corner = (here / block_m).array().round() * block_m;
  T_grid_map_ = SE3(Eigen::Quaterniond::Identity(), -corner);
  const Sorted sorted = SortIntoBlocks(scans, sensor);
  cells_.resize(index_of_.size());
  ParallelFor(pool, cells_.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) cells_[b] = CellsOf(sorted, b);
  });
}

PointGrid::Sorted PointGrid::SortIntoBlocks(std::span<const PosedPoints> scans,
                                            const SensorModel& sensor) {
  Sorted sorted;
  std::size_t total = 0;
  for (const PosedPoints& scan : scans) total += scan.points.size();
  const auto min_square = static_cast<float>(sensor.MinRange() * sensor.MinRange());
  const auto max_square = static_cast<float>(sensor.MaxRange() * sensor.MaxRange());
  std::vector<Sorted::Point> points;
  std::vector<int> block_of;  // -1: left out
  std::vector<std::size_t> size;
  points.reserve(total);
  block_of.reserve(total);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const SE3 T_grid_sensor = T_grid_map_ * scans[s].T_map_sensor;
    const Eigen::Matrix3f rotation = T_grid_sensor.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_grid_sensor.Translation().cast<float>();
    sorted.sensor.push_back(T_grid_sensor.Translation());
    for (std::size_t i = 0; i < scans[s].points.size(); ++i) {
      const Eigen::Vector3f& p = scans[s].points[i];
      const float square = p.squaredNorm();
      const float intensity = scans[s].intensity.empty() ? 0.0f : scans[s].intensity[i];
      const Eigen::Vector3f p_grid = rotation * p + translation;
      const Eigen::Vector3i finest_cell = FinestCellOf(p_grid);
      points.push_back({p_grid, CodeOf(finest_cell), static_cast<int>(s), intensity});
      int block = -1;
      if (square >= min_square && square <= max_square) {
        const Eigen::Vector3i index = BlockOf(finest_cell);
        const auto fresh = static_cast<int>(index_of_.size());
        block = index_of_.size() < kMaxBlocks ? block_at_.FindOrInsert(index, fresh)
                                              : block_at_.Find(index);
        if (block == fresh) {
          index_of_.push_back(index);
          size.push_back(0);
        }
      }
      block_of.push_back(block);
      if (block >= 0) ++size[static_cast<std::size_t>(block)];
    }
  }
  sorted.begin.assign(size.size() + 1, 0);
  for (std::size_t b = 0; b < size.size(); ++b) sorted.begin[b + 1] = sorted.begin[b] + size[b];
  sorted.points.resize(sorted.begin.back());
  std::vector<std::size_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (block_of[i] < 0) continue;
    sorted.points[next[static_cast<std::size_t>(block_of[i])]++] = points[i];
  }
  return sorted;
}

Eigen::Vector3i PointGrid::BlockOf(const Eigen::Vector3i& finest_cell) const {
  return finest_cell.unaryExpr([this](int coordinate) { return coordinate >> levels_; });
}

int PointGrid::CodeOf(const Eigen::Vector3i& finest_cell) const {
  const int last = (1 << levels_) - 1;
  const auto spread = [&](int axis) {
    return kSpread[static_cast<std::size_t>(finest_cell[axis] & last)] << axis;
  };
  return spread(0) | spread(1) | spread(2);
}

std::vector<PointCell> PointGrid::CellsOf(const Sorted& sorted, std::size_t block) const {
  const Eigen::Vector3d corner = Corner(block);
  std::vector<int> slot_of(static_cast<std::size_t>(CellsPerBlock()), -1);
  std::vector<PointCell> cells;
  for (std::size_t i = sorted.begin[block]; i < sorted.begin[block + 1]; ++i) {
    const Sorted::Point& point = sorted.points[i];
    int& slot = slot_of[static_cast<std::size_t>(point.code)];
    if (slot < 0) {
      slot = static_cast<int>(cells.size());
      cells.push_back({point.code, {}});
    }
    cells[static_cast<std::size_t>(slot)].moments.Add(
        point.p_grid.cast<double>() - corner,
        sorted.sensor[static_cast<std::size_t>(point.scan)] - corner,
        static_cast<double>(point.intensity));
  }
  std::sort(cells.begin(), cells.end(), [](const PointCell& a, const PointCell& b) {
    return a.code < b.code;
  });
  return cells;
}

Eigen::Vector3d PointGrid::MiddleOf(std::size_t block, int code) const {
  Eigen::Vector3d cell = Eigen::Vector3d::Zero();
  for (int bit = 0; bit < levels_; ++bit) {
    for (int axis = 0; axis < 3; ++axis) cell[axis] += (code >> (3 * bit + axis) & 1) << bit;
  }
  return Corner(block) + CellSize(levels_) * (cell.array() + 0.5).matrix();
}

std::optional<PointGrid::Place> PointGrid::Find(const Eigen::Vector3f& p_grid) const {
  const Eigen::Vector3i finest_cell = FinestCellOf(p_grid);
  const int block = block_at_.Find(BlockOf(finest_cell));
  if (block < 0) return std::nullopt;
  return Place{static_cast<std::size_t>(block), CodeOf(finest_cell)};
}

}  // namespace covsplat
