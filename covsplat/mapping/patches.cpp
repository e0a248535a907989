#include "covsplat/mapping/patches.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/registration/symmetric_eigen.hpp"

namespace covsplat {
namespace {

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

/// Standard deviation of ranges to flat surfaces: the median among the eighths of the blocks.
double EstimateNoise(const PointGrid& grid, int min_points) {
  std::vector<double> variance;
  for (std::size_t b = 0; b < grid.Blocks(); ++b) {
    ForEighths(grid.Cells(b), std::max(0, grid.Levels() - 1), [&](auto cells) {
      const Moments moments = SumOf(cells);
      if (moments.count < 5.0 * min_points) return;
      const Plane plane = PlaneOf(moments);
      if (plane.cosine < kHeadOn || plane.variance[1] < 4.0 * plane.variance[2]) return;
      variance.push_back(plane.variance[2] / (plane.cosine * plane.cosine));
    });
  }
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

/// The square that a disc stands for, a little within its edges.
struct Square {
  Eigen::Vector3f middle;
  Eigen::Vector3f u;  ///< to the middles of its edges
  Eigen::Vector3f v;

  Eigen::AlignedBox3f Box(const Eigen::Vector3f& margin) const {
    const Eigen::Vector3f reach = u.cwiseAbs() + v.cwiseAbs() + margin;
    return {middle - reach, middle + reach};
  }
};

Square SquareOf(const Disc& disc, double edge_sigmas, float finest_m) {
  constexpr float kMaxEdgeM = 5.0f;  // maps have none that large; one would take forever
  const auto within = [&](const Eigen::Vector3f& axis) -> Eigen::Vector3f {
    const float length = static_cast<float>(edge_sigmas) * axis.norm() - 0.25f * finest_m;
    return axis.normalized() * std::clamp(length, 0.0f, kMaxEdgeM);
  };
  return {disc.mean, within(disc.u), within(disc.v)};
}

/// Calls f(position) at steps of less than a finest cell over a square.
template <class F>
void ForPlacesOf(const Square& square, float finest_m, F&& f) {
  const auto steps_u = static_cast<int>(std::round(square.u.norm() / (0.7f * finest_m)));
  const auto steps_v = static_cast<int>(std::round(square.v.norm() / (0.7f * finest_m)));
  const Eigen::Vector3f step_u = square.u / static_cast<float>(std::max(1, steps_u));
  const Eigen::Vector3f step_v = square.v / static_cast<float>(std::max(1, steps_v));
  for (int i = -steps_u; i <= steps_u; ++i) {
    const Eigen::Vector3f row = square.middle + static_cast<float>(i) * step_u;
    for (int j = -steps_v; j <= steps_v; ++j) f(row + static_cast<float>(j) * step_v);
  }
}

/// [block][code] indices of discs, or none.
using DiscsOfCells = std::vector<std::vector<int>>;

/// The densest of the discs that pass through each cell.
DiscsOfCells DensestDiscs(std::span<const Disc> discs_grid,
                          const PointGrid& grid,
                          double extent_factor) {
  DiscsOfCells densest(grid.Blocks(),
                       std::vector<int>(static_cast<std::size_t>(grid.CellsPerBlock()), kNone));
  const auto finest_m = static_cast<float>(grid.CellSize(grid.Levels()));
  for (std::size_t i = 0; i < discs_grid.size(); ++i) {
    const Disc& disc = discs_grid[i];
    // A disc also passes through cells on either side that are close to it.
    const Eigen::Vector3f off = 0.15f * finest_m * disc.u.cross(disc.v).normalized();
    const Square square = SquareOf(disc, kEdgeSigmas / extent_factor, finest_m);
    if (!grid.HoldsAnyIn(square.Box(off.cwiseAbs()))) continue;
    PointGrid::Finder finder(grid);
    const auto mark = [&](const Eigen::Vector3f& p) {
      const std::optional<PointGrid::Place> place = finder.FindNew(p);
      if (!place) return;
      int& known = densest[place->block][static_cast<std::size_t>(place->code)];
      const bool is_denser =
          known == kNone || disc.density > discs_grid[static_cast<std::size_t>(known)].density;
      if (is_denser) known = static_cast<int>(i);
    };
    ForPlacesOf(square, finest_m, [&](const Eigen::Vector3f& p) {
      mark(p);
      if (grid.IsWithinCell(p, off.cwiseAbs())) return;
      mark(p - off);
      mark(p + off);
    });
  }
  return densest;
}

std::vector<Disc> Moved(const SE3& T_to_from, std::span<const Disc> discs) {
  const Eigen::Matrix3f rotation = T_to_from.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_to_from.Translation().cast<float>();
  std::vector<Disc> moved;
  moved.reserve(discs.size());
  for (const Disc& disc : discs) {
    moved.push_back(
        {rotation * disc.mean + translation, rotation * disc.u, rotation * disc.v, disc.density});
  }
  return moved;
}

Patch Moved(const SE3& T_to_from, Patch patch) {
  const Eigen::Matrix3f rotation = T_to_from.RotationMatrix().cast<float>();
  patch.mean = rotation * patch.mean + T_to_from.Translation().cast<float>();
  patch.axes = rotation * patch.axes;
  return patch;
}

FitJob MakeJob(const PointGrid& grid, std::span<const Disc> known, const PatchConfig& config) {
  FitJob job{&grid, known, &config, EstimateNoise(grid, config.min_points), config.levels};
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
                                    const std::vector<BlockFit>& fits) {
  std::vector<std::uint8_t> stays;
  stays.reserve(discs_grid.size());
  for (const Disc& disc : discs_grid) {
    const std::optional<PointGrid::Place> place = grid.Find(disc.mean);
    stays.push_back(!place || !IsRenewed(*place, fits));
  }
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
  const std::vector<Disc> discs_grid = Moved(T_grid_sensor, known);
  const DiscsOfCells densest = DensestDiscs(discs_grid, grid, config.extent_factor);
  const FitJob job = MakeJob(grid, discs_grid, config);
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
  const std::vector<std::uint8_t> stays = WhichStay(discs_grid, grid, fits);
  for (std::size_t i = 0; i < stays.size(); ++i) {
    if (stays[i] == 0) result.replaced.push_back(i);
  }
  const Eigen::Matrix3f rotation = T_grid_sensor.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_grid_sensor.Translation().cast<float>();
  for (const Eigen::Vector3f& p : scans.back().points) {
    const std::optional<PointGrid::Place> place =
        p.allFinite() ? grid.Find(rotation * p + translation) : std::nullopt;
    result.covered.push_back(place && IsCovered(*place, fits, densest, stays));
  }
  return result;
}

}  // namespace covsplat
