#include "covsplat/mapping/point_grid.hpp"

#include <algorithm>
#include <array>
#include <utility>

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

struct PointGrid::Point {
  Eigen::Vector3f p_grid;
  int code = 0;
  int scan = 0;
  float intensity = 0.0f;
};

/// Points of all scans as they come, and the blocks that they lie in.
struct PointGrid::Located {
  std::vector<Eigen::Vector3d> sensor;  ///< [scans] positions in the frame of the grid
  std::vector<Point> points;            ///< [N]
  std::vector<Eigen::Vector3i> block;   ///< [N]
  std::vector<std::uint8_t> usable;     ///< [N]
};

/// All usable points, block after block.
struct PointGrid::Sorted {
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
  const Sorted sorted = SortIntoBlocks(Locate(scans, sensor, pool));
  cells_.resize(index_of_.size());
  ParallelFor(pool, cells_.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<int> slot_of(static_cast<std::size_t>(CellsPerBlock()), -1);
    for (std::size_t b = begin; b < end; ++b) cells_[b] = CellsOf(sorted, b, slot_of);
  });
}

PointGrid::Located PointGrid::Locate(std::span<const PosedPoints> scans,
                                     const SensorModel& sensor,
                                     ThreadPool& pool) const {
  const auto min_square = static_cast<float>(sensor.MinRange() * sensor.MinRange());
  const auto max_square = static_cast<float>(sensor.MaxRange() * sensor.MaxRange());
  std::size_t total = 0;
  for (const PosedPoints& scan : scans) total += scan.points.size();
  Located located;
  located.points.resize(total);
  located.block.resize(total);
  located.usable.resize(total);
  std::size_t first = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const PosedPoints& scan = scans[s];
    const SE3 T_grid_sensor = T_grid_map_ * scan.T_map_sensor;
    const Eigen::Matrix3f rotation = T_grid_sensor.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_grid_sensor.Translation().cast<float>();
    located.sensor.push_back(T_grid_sensor.Translation());
    ParallelFor(pool, scan.points.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const float square = scan.points[i].squaredNorm();
        const Eigen::Vector3f p_grid = rotation * scan.points[i] + translation;
        const Eigen::Vector3i finest_cell = FinestCellOf(p_grid);
        const float intensity = scan.intensity.empty() ? 0.0f : scan.intensity[i];
        const std::size_t at = first + i;
        located.points[at] = {p_grid, CodeOf(finest_cell), static_cast<int>(s), intensity};
        located.block[at] = BlockOf(finest_cell);
        located.usable[at] = square >= min_square && square <= max_square;
      }
    });
    first += scan.points.size();
  }
  return located;
}

PointGrid::Sorted PointGrid::SortIntoBlocks(Located located) {
  std::vector<int> block_of(located.points.size(), -1);  // -1: left out
  std::vector<std::size_t> size;
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < located.points.size(); ++i) {
    if (located.usable[i] == 0) continue;
    // Neighbours along a beam mostly share a block.
    const bool is_same = last && located.block[i] == located.block[*last];
    block_of[i] = is_same ? block_of[*last] : FindOrAddBlock(located.block[i]);
    last = i;
    if (block_of[i] < 0) continue;
    size.resize(index_of_.size(), 0);
    ++size[static_cast<std::size_t>(block_of[i])];
  }
  Sorted sorted;
  sorted.sensor = std::move(located.sensor);
  sorted.begin.assign(size.size() + 1, 0);
  for (std::size_t b = 0; b < size.size(); ++b) sorted.begin[b + 1] = sorted.begin[b] + size[b];
  sorted.points.resize(sorted.begin.back());
  std::vector<std::size_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (std::size_t i = 0; i < located.points.size(); ++i) {
    if (block_of[i] < 0) continue;
    sorted.points[next[static_cast<std::size_t>(block_of[i])]++] = located.points[i];
  }
  return sorted;
}

int PointGrid::FindOrAddBlock(const Eigen::Vector3i& index) {
  if (index_of_.size() >= kMaxBlocks) return block_at_.Find(index);
  const auto fresh = static_cast<int>(index_of_.size());
  const int block = block_at_.FindOrInsert(index, fresh);
  if (block == fresh) index_of_.push_back(index);
  return block;
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

std::vector<PointCell> PointGrid::CellsOf(const Sorted& sorted,
                                          std::size_t block,
                                          std::span<int> slot_of) const {
  const Eigen::Vector3d corner = Corner(block);
  std::vector<PointCell> cells;
  for (std::size_t i = sorted.begin[block]; i < sorted.begin[block + 1]; ++i) {
    const Point& point = sorted.points[i];
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
  for (const PointCell& cell : cells) slot_of[static_cast<std::size_t>(cell.code)] = -1;
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
