#include "covsplat/mapping/patches.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/registration/symmetric_eigen.hpp"

namespace covsplat {
namespace {

/// Calls f(i) for each of many small things.
template <class F>
void ForEach(ThreadPool& pool, std::size_t count, F&& f) {
  ParallelFor(pool, count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) f(i);
  });
}

/// All that f(i, found) appends, in the order of i.
template <class T, class F>
std::vector<T> Collect(ThreadPool& pool, std::size_t count, std::size_t grain, F&& f) {
  std::vector<std::vector<T>> parts((count + grain - 1) / grain);
  ParallelFor(pool, count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) f(i, parts[begin / grain]);
  });
  std::vector<T> all;
  for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

constexpr double kNoiseWithoutCells = 0.02;
/// Cosine of the flattest incidence at which the noise of ranges can be told.
constexpr double kHeadOn = 0.5;
/// Smaller cells would cut the noise off, not resolve the surface.
constexpr double kMinCellInNoise = 4.0;
/// Least standard deviation of measurements that have an extent, in sizes of their cell.
constexpr double kMinSpread = 0.1;
/// Half the side of an evenly filled square, in its standard deviations.
constexpr double kEdgeSigmas = 1.7320508;

struct Plane {
  Eigen::Vector3d mean;
  Eigen::Matrix3d axes;      ///< columns: descending variance, so the last is the normal
  Eigen::Vector3d variance;  ///< descending
  double cosine;             ///< of the incidence of the rays that measured it
  double density;            ///< measurements per m2, if they fill its extent evenly
};

Plane PlaneOf(const Moments& moments) {
  const SymmetricEigen eigen = DecomposeSymmetric(moments.Covariance());
  Plane plane;
  plane.mean = moments.Mean();
  plane.axes = eigen.vectors;
  plane.variance = eigen.values.cwiseMax(0.0);
  const double area_m2 = 12.0 * std::sqrt(plane.variance[0] * plane.variance[1]);
  plane.density = moments.count / std::max(area_m2, 1e-6);
  plane.cosine = std::abs(plane.axes.col(2).dot(moments.to_sensor.normalized()));
  // A plane through n points leaves n - 3 degrees of freedom.
  plane.variance[2] *= moments.count / std::max(1.0, moments.count - 3.0);
  return plane;
}

Moments SumOf(std::span<const PointCell> cells) {
  Moments sum;
  for (const PointCell& cell : cells) sum.Add(cell.moments);
  return sum;
}

/// Calls f(cells) for each eighth of a cell of some level that holds measurements; `levels_below`
/// counts from the eighths to the finest cells.
template <class F>
void ForEighths(std::span<const PointCell> cells, int levels_below, F&& f) {
  const int shift = 3 * levels_below;
  for (std::size_t begin = 0; begin < cells.size();) {
    std::size_t end = begin + 1;
    while (end < cells.size() && cells[end].code >> shift == cells[begin].code >> shift) ++end;
    f(cells.subspan(begin, end - begin));
    begin = end;
  }
}

/// Variances of ranges to flat surfaces, of the eighths of a block.
void AppendNoise(std::span<const PointCell> block,
                 int levels,
                 int min_points,
                 std::vector<double>& variance) {
  ForEighths(block, std::max(0, levels - 1), [&](auto cells) {
    const Moments moments = SumOf(cells);
    if (moments.count < 5.0 * min_points) return;
    const Plane plane = PlaneOf(moments);
    if (plane.cosine < kHeadOn || plane.variance[1] < 4.0 * plane.variance[2]) return;
    variance.push_back(plane.variance[2] / (plane.cosine * plane.cosine));
  });
}

/// Standard deviation of ranges to flat surfaces: the median among the eighths of the blocks.
double EstimateNoise(const PointGrid& grid, int min_points, ThreadPool& pool) {
  auto variance =
      Collect<double>(pool, grid.Blocks(), 256, [&](std::size_t block, std::vector<double>& found) {
        AppendNoise(grid.Cells(block), grid.Levels(), min_points, found);
      });
  if (variance.empty()) return kNoiseWithoutCells;
  const auto middle = variance.begin() + static_cast<std::ptrdiff_t>(variance.size() / 2);
  std::nth_element(variance.begin(), middle, variance.end());
  return std::sqrt(*middle);
}

constexpr int kNone = -1;

/// What all blocks have in common.
struct FitJob {
  const PointGrid* grid;
  std::span<const Disc> known;  ///< frame of the grid
  const PatchConfig* config;
  double noise_m;    ///< of ranges
  int finest_level;  ///< cells are not halved beyond
};

/// What a block's cells have become.
struct BlockFit {
  std::vector<Patch> patches;         ///< frame of the grid
  std::vector<std::uint8_t> renewed;  ///< [code] whether a new patch has the cell
};

bool IsFlat(const Plane& plane, const FitJob& job) {
  const double noise_m = job.noise_m * plane.cosine;
  return plane.variance[2] <= noise_m * noise_m + job.config->flatness_m * job.config->flatness_m;
}

/// Whether the known discs that pass through most of the measurements were made of about as many.
/// `densest`: [code] of those that pass, or none.
bool IsKnown(std::span<const PointCell> cells,
             double count,
             double density,
             std::span<const int> densest,
             const FitJob& job) {
  const auto enough = static_cast<float>(density / job.config->renew_factor);
  double known = 0.0;
  for (const PointCell& cell : cells) {
    const int disc = densest[static_cast<std::size_t>(cell.code)];
    if (disc == kNone || job.known[static_cast<std::size_t>(disc)].density <= enough) continue;
    known += cell.moments.count;
  }
  return known > 0.5 * count;
}

Patch PatchOf(const Plane& plane, const Moments& moments, const Eigen::Vector3d& corner) {
  const double side = plane.axes.col(2).dot(moments.to_sensor) < 0.0 ? -1.0 : 1.0;
  Patch patch;
  patch.mean = (plane.mean + corner).cast<float>();
  patch.axes.col(0) = plane.axes.col(0).cast<float>();
  patch.axes.rightCols<2>() = (side * plane.axes.rightCols<2>()).cast<float>();
  patch.sigma_m = plane.variance.cwiseSqrt().cast<float>();
  patch.density = static_cast<float>(plane.density);
  patch.intensity = static_cast<float>(moments.intensity / moments.count);
  return patch;
}

/// Goes through a cell of a block from coarse to fine.
void FitCells(std::span<const PointCell> cells,
              int level,
              const Eigen::Vector3d& corner,
              std::span<const int> densest,
              const FitJob& job,
              BlockFit& fit) {
  const bool is_finest = level >= job.finest_level;
  const Moments moments = SumOf(cells);
  // Cells that cannot be halved do with half the measurements.
  const int min_points = is_finest ? (job.config->min_points + 1) / 2 : job.config->min_points;
  if (moments.count < min_points) return;
  const double min_spread_m = kMinSpread * job.grid->CellSize(level);
  const Plane plane = PlaneOf(moments);
  const bool has_extent = plane.variance[1] > min_spread_m * min_spread_m;
  if (has_extent && (is_finest || IsFlat(plane, job))) {
    if (IsKnown(cells, moments.count, plane.density, densest, job)) return;
    fit.patches.push_back(PatchOf(plane, moments, corner));
    for (const PointCell& cell : cells) fit.renewed[static_cast<std::size_t>(cell.code)] = 1;
    return;
  }
  if (is_finest) return;
  ForEighths(cells, job.grid->Levels() - level - 1, [&](auto eighth) {
    FitCells(eighth, level + 1, corner, densest, job, fit);
  });
}

/// The square that a disc stands for, in the frame of the grid.
struct Square {
  Eigen::Vector3f middle;
  Eigen::Matrix3f axes;   ///< columns: along its edges, normal
  Eigen::Vector3f half;   ///< of its sides, and of a little thickness
  Eigen::Vector3f width;  ///< of a cube with edges of 2 m, seen along its axes

  Eigen::AlignedBox3f Box() const {
    const Eigen::Vector3f reach = axes.cwiseAbs() * half;
    return {middle - reach, middle + reach};
  }

  /// How far from it, along its axes, the middles of cells are that it meets (of the separating
  /// axes of two boxes those that matter).
  Eigen::Vector3f ReachTo(float half_cell) const { return half + half_cell * width; }
};

/// A disc also passes through cells on either side that are close to it, but not through those that
/// its edges hardly reach.
Square SquareOf(const Disc& disc, double edge_sigmas, float finest_m) {
  constexpr float kMaxEdgeM = 5.0f;  // maps have none that large; one would take forever
  const auto half = [&](const Eigen::Vector3f& axis) {
    const float length = static_cast<float>(edge_sigmas) * axis.norm() - 0.25f * finest_m;
    return std::clamp(length, 0.0f, kMaxEdgeM);
  };
  Square square;
  square.middle = disc.mean;
  square.axes << disc.u.normalized(), disc.v.normalized(), disc.u.cross(disc.v).normalized();
  square.half << half(disc.u), half(disc.v), 0.15f * finest_m;
  square.width = square.axes.cwiseAbs().colwise().sum().transpose();
  return square;
}

bool Meets(const Square& square, const Eigen::Vector3f& cell_middle, float half_cell) {
  const Eigen::Vector3f apart = square.axes.transpose() * (cell_middle - square.middle);
  return (apart.cwiseAbs().array() <= square.ReachTo(half_cell).array()).all();
}

/// [block] indices of squares, ascending.
using SquaresOfBlocks = std::vector<std::vector<int>>;

SquaresOfBlocks SortIntoBlocks(std::span<const Square> squares,
                               const PointGrid& grid,
                               ThreadPool& pool) {
  struct Meeting {
    std::size_t block;
    int square;
  };
  const auto half_m = static_cast<float>(0.5 * grid.CellSize(0));
  const auto meetings =
      Collect<Meeting>(pool, squares.size(), 1024, [&](std::size_t i, std::vector<Meeting>& found) {
        grid.ForBlocksIn(squares[i].Box(), [&](std::size_t block) {
          const Eigen::Vector3d corner = grid.Corner(block);
          const Eigen::Vector3d middle = corner.array() + 0.5 * grid.CellSize(0);
          if (!Meets(squares[i], middle.cast<float>(), half_m)) return;
          found.push_back({block, static_cast<int>(i)});
        });
      });
  SquaresOfBlocks of_blocks(grid.Blocks());
  for (const Meeting& meeting : meetings) of_blocks[meeting.block].push_back(meeting.square);
  return of_blocks;
}

/// The cells of a block, side by side.
class BlockCells {
 public:
  void Fill(const PointGrid& grid, std::size_t block) {
    const std::span<const PointCell> cells = grid.Cells(block);
    for (std::vector<float>* axis : {&x_, &y_, &z_}) axis->resize(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Eigen::Vector3d middle = grid.MiddleOf(block, cells[i].code);
      x_[i] = static_cast<float>(middle.x());
      y_[i] = static_cast<float>(middle.y());
      z_[i] = static_cast<float>(middle.z());
    }
    density_.assign(cells.size(), -1.0f);
    disc_.assign(cells.size(), kNone);
  }

  /// Notes the disc in those cells that it passes through and no denser one does.
  void Pass(const Square& square, float half_cell, int disc, float density) {
    const Eigen::Matrix3f to_square = square.axes.transpose();
    const Eigen::Vector3f offset = to_square * square.middle;
    const Eigen::Vector3f reach = square.ReachTo(half_cell);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const auto apart = [&](int axis) {
        return std::abs(to_square(axis, 0) * x_[i] + to_square(axis, 1) * y_[i] +
                        to_square(axis, 2) * z_[i] - offset[axis]);
      };
      const bool is_densest = density > density_[i] && apart(0) <= reach[0] &&
                              apart(1) <= reach[1] && apart(2) <= reach[2];
      density_[i] = is_densest ? density : density_[i];
      disc_[i] = is_densest ? disc : disc_[i];
    }
  }

  int Densest(std::size_t cell) const { return disc_[cell]; }

 private:
  std::vector<float> x_;
  std::vector<float> y_;
  std::vector<float> z_;
  std::vector<float> density_;
  std::vector<int> disc_;
};

/// [block][code] indices of discs, or none.
using DiscsOfCells = std::vector<std::vector<int>>;

/// The densest of the discs that pass through each cell that holds measurements.
DiscsOfCells DensestDiscs(std::span<const Disc> discs_grid,
                          const PointGrid& grid,
                          double extent_factor,
                          ThreadPool& pool) {
  constexpr float kInsideCell = 0.75f;  // a corner that is touched is not passed through
  const auto finest_m = static_cast<float>(grid.CellSize(grid.Levels()));
  std::vector<Square> squares(discs_grid.size());
  ForEach(pool, squares.size(), [&](std::size_t i) {
    squares[i] = SquareOf(discs_grid[i], kEdgeSigmas / extent_factor, finest_m);
  });
  const SquaresOfBlocks squares_of = SortIntoBlocks(squares, grid, pool);
  DiscsOfCells densest(grid.Blocks());
  ParallelFor(pool, grid.Blocks(), 64, [&](std::size_t begin, std::size_t end) {
    BlockCells cells;
    for (std::size_t b = begin; b < end; ++b) {
      densest[b].assign(static_cast<std::size_t>(grid.CellsPerBlock()), kNone);
      if (squares_of[b].empty()) continue;
      cells.Fill(grid, b);
      for (const int i : squares_of[b]) {
        const auto disc = static_cast<std::size_t>(i);
        cells.Pass(squares[disc], 0.5f * kInsideCell * finest_m, i, discs_grid[disc].density);
      }
      for (std::size_t k = 0; k < grid.Cells(b).size(); ++k) {
        densest[b][static_cast<std::size_t>(grid.Cells(b)[k].code)] = cells.Densest(k);
      }
    }
  });
  return densest;
}

std::vector<Disc> Moved(const SE3& T_to_from, std::span<const Disc> discs, ThreadPool& pool) {
  const Eigen::Matrix3f rotation = T_to_from.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_to_from.Translation().cast<float>();
  std::vector<Disc> moved(discs.size());
  ForEach(pool, discs.size(), [&](std::size_t i) {
    const Disc& disc = discs[i];
    moved[i] = {
        rotation * disc.mean + translation, rotation * disc.u, rotation * disc.v, disc.density};
  });
  return moved;
}

Patch Moved(const SE3& T_to_from, Patch patch) {
  const Eigen::Matrix3f rotation = T_to_from.RotationMatrix().cast<float>();
  patch.mean = rotation * patch.mean + T_to_from.Translation().cast<float>();
  patch.axes = rotation * patch.axes;
  return patch;
}

FitJob MakeJob(const PointGrid& grid,
               std::span<const Disc> known,
               const PatchConfig& config,
               ThreadPool& pool) {
  FitJob job{&grid, known, &config, EstimateNoise(grid, config.min_points, pool), config.levels};
  while (job.finest_level > 0 && grid.CellSize(job.finest_level) < kMinCellInNoise * job.noise_m) {
    --job.finest_level;
  }
  return job;
}

bool IsRenewed(const PointGrid::Place& place, const std::vector<BlockFit>& fits) {
  return fits[place.block].renewed[static_cast<std::size_t>(place.code)] != 0;
}

/// [known] whether a disc's middle is not in a new patch's cell.
std::vector<std::uint8_t> WhichStay(std::span<const Disc> discs_grid,
                                    const PointGrid& grid,
                                    const std::vector<BlockFit>& fits,
                                    ThreadPool& pool) {
  std::vector<std::uint8_t> stays(discs_grid.size());
  ForEach(pool, discs_grid.size(), [&](std::size_t i) {
    const std::optional<PointGrid::Place> place = grid.Find(discs_grid[i].mean);
    stays[i] = !place || !IsRenewed(*place, fits);
  });
  return stays;
}

bool IsCovered(const PointGrid::Place& place,
               const std::vector<BlockFit>& fits,
               const DiscsOfCells& densest,
               const std::vector<std::uint8_t>& stays) {
  const int disc = densest[place.block][static_cast<std::size_t>(place.code)];
  return IsRenewed(place, fits) || (disc != kNone && stays[static_cast<std::size_t>(disc)] != 0);
}

}  // namespace

PatchFit FitPatches(std::span<const PosedPoints> scans,
                    std::span<const Disc> known,
                    const SensorModel& sensor,
                    const PatchConfig& config,
                    ThreadPool& pool) {
  PatchFit result;
  if (scans.empty()) return result;
  const PointGrid grid(scans, sensor, config.cell_m, config.levels, pool);
  const SE3 T_grid_sensor = grid.FromMap() * scans.back().T_map_sensor;
  const std::vector<Disc> discs_grid = Moved(T_grid_sensor, known, pool);
  const DiscsOfCells densest = DensestDiscs(discs_grid, grid, config.extent_factor, pool);
  const FitJob job = MakeJob(grid, discs_grid, config, pool);
  std::vector<BlockFit> fits(grid.Blocks());
  ParallelFor(pool, grid.Blocks(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      fits[b].renewed.assign(static_cast<std::size_t>(grid.CellsPerBlock()), 0);
      FitCells(grid.Cells(b), 0, grid.Corner(b), densest[b], job, fits[b]);
    }
  });

  const SE3 T_sensor_grid = T_grid_sensor.Inverse();
  for (const BlockFit& fit : fits) {
    for (const Patch& patch : fit.patches) result.patches.push_back(Moved(T_sensor_grid, patch));
  }
  const std::vector<std::uint8_t> stays = WhichStay(discs_grid, grid, fits, pool);
  for (std::size_t i = 0; i < stays.size(); ++i) {
    if (stays[i] == 0) result.replaced.push_back(i);
  }
  const Eigen::Matrix3f rotation = T_grid_sensor.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_grid_sensor.Translation().cast<float>();
  const std::span<const Eigen::Vector3f> points = scans.back().points;
  result.covered.resize(points.size());
  ForEach(pool, points.size(), [&](std::size_t i) {
    const std::optional<PointGrid::Place> place =
        points[i].allFinite() ? grid.Find(rotation * points[i] + translation) : std::nullopt;
    result.covered[i] = place && IsCovered(*place, fits, densest, stays);
  });
  return result;
}

}  // namespace covsplat
