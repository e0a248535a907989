#include "covsplat/registration/voxel_moments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <hwy/highway.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr hn::FixedTag<float, 4> kFour;
using Four = hn::Vec<decltype(kFour)>;

// Measurements a voxel may contribute as. Near the sensor voxels hold hundreds of points; without a
// limit they would pull the fit to the nearest rings.
constexpr float kCountLimit = 12.0f;
// A standard deviation across the surface below this is measurement noise.
constexpr double kFlat_m = 0.04;

// Second variance in relation to the first; below this it is one scan line.
bool SpansASurface(const SymmetricEigen& eigen) { return eigen.values[1] > 0.03 * eigen.values[0]; }

bool IsFlat(const SymmetricEigen& eigen) { return eigen.values[2] < kFlat_m * kFlat_m; }

SymmetricEigen Decompose(const std::array<float, 4>& square, const std::array<float, 4>& mixed) {
  Eigen::Matrix3f covariance;
  covariance << square[0], mixed[0], mixed[2], mixed[0], square[1], mixed[1], mixed[2], mixed[1],
      square[2];
  return DecomposeSymmetric(covariance.cast<double>());
}

// Moments of positions x y z x: of such a vector, its product with itself turned by one lane is
// xy yz zx.
struct Moments {
  Four mean = hn::Zero(kFour);
  Four square = hn::Zero(kFour);
  Four mixed = hn::Zero(kFour);

  HWY_INLINE void Add(Four position) {
    mean = hn::Add(mean, position);
    square = hn::MulAdd(position, position, square);
    mixed = hn::MulAdd(position, hn::Shuffle0321(position), mixed);
  }

  // Of sums to means, with squares about the mean.
  HWY_INLINE void Normalize(float weight) {
    const Four share = hn::Set(kFour, 1.0f / weight);
    mean = hn::Mul(mean, share);
    square = hn::Sub(hn::Mul(square, share), hn::Mul(mean, mean));
    mixed = hn::Sub(hn::Mul(mixed, share), hn::Mul(mean, hn::Shuffle0321(mean)));
  }
};

// x y z x of a point.
HWY_INLINE Four LoadPosition(const Eigen::Vector4f& point) {
  const Four xyz = hn::LoadU(kFour, point.data());
  return hn::IfThenElse(hn::FirstN(kFour, 3), xyz, hn::Shuffle0321(xyz));
}

// x y z x.
HWY_INLINE Four Position(float x, float y, float z) {
  alignas(16) const std::array<float, 4> lanes = {x, y, z, x};
  return hn::Load(kFour, lanes.data());
}

// Sum of the first three lanes.
HWY_INLINE float SumXyz(Four v) {
  return hn::GetLane(hn::Add(hn::Add(v, hn::Shuffle2301(v)), hn::Shuffle1032(v)));
}

// Of the cell of a position in cells. Far positions and NaN are clamped, as by CellOf.
HWY_INLINE Four FloorWithinLimits(Four position) {
  const Four above = hn::Max(position, hn::Set(kFour, -kCellLimit));
  return hn::Floor(hn::Min(above, hn::Set(kFour, kCellLimit)));
}

HWY_INLINE Eigen::Vector3i CellAt(Four floor) {
  constexpr hn::FixedTag<std::int32_t, 4> kInts;
  alignas(16) std::array<std::int32_t, 4> cell;
  hn::Store(hn::ConvertTo(kInts, floor), kInts, cell.data());
  return {cell[0], cell[1], cell[2]};
}

}  // namespace

// Through a point, both relative to the central voxel's centre.
struct VoxelMoments::Plane {
  Four normal;
  Four point;

  HWY_INLINE float WeightOf(Four position) const {
    constexpr float kWidth = 0.05f;  // m
    const float distance = SumXyz(hn::Mul(normal, hn::Sub(position, point))) / kWidth;
    const float fading = 1.0f / (1.0f + distance * distance);
    return fading * fading;
  }
};

// Sums over voxels, from the central voxel's centre.
class VoxelMoments::Neighbourhood {
 public:
  // `mean`: of the voxel.
  HWY_INLINE void Add(const Voxel& voxel, Four mean, float share) {
    const float weight = share * std::min(voxel.Count(), kCountLimit);
    const Four weights = hn::Set(kFour, weight);
    const Four square = hn::MulAdd(mean, mean, hn::Load(kFour, voxel.square.data()));
    const Four mixed = hn::MulAdd(mean, hn::Shuffle0321(mean), hn::Load(kFour, voxel.mixed.data()));
    measurements_ += voxel.Count();
    ++voxels_;
    weight_ += weight;
    sums_.mean = hn::MulAdd(weights, mean, sums_.mean);
    sums_.square = hn::MulAdd(weights, square, sums_.square);
    sums_.mixed = hn::MulAdd(weights, mixed, sums_.mixed);
  }

  float Measurements() const { return measurements_; }
  int Voxels() const { return voxels_; }

  SymmetricEigen Decomposed() const {
    Moments moments = sums_;
    moments.Normalize(weight_);
    alignas(16) std::array<float, 4> square;
    alignas(16) std::array<float, 4> mixed;
    hn::Store(moments.square, kFour, square.data());
    hn::Store(moments.mixed, kFour, mixed.data());
    return Decompose(square, mixed);
  }

 private:
  float measurements_ = 0.0f;
  int voxels_ = 0;
  float weight_ = 0.0f;
  Moments sums_;
};

VoxelMoments::VoxelMoments(std::span<const Eigen::Vector4f> points, float voxel_m)
    : voxel_m_(voxel_m) {
  COVSPLAT_CHECK(voxel_m > 0.0f);
  Collect(points);
  SortIntoColumns();
}

void VoxelMoments::Collect(std::span<const Eigen::Vector4f> points) {
  struct Tally {
    Moments sums;
    float count = 0.0f;
    float nearest = std::numeric_limits<float>::infinity();  // squared, to the voxel's centre
  };
  const std::size_t expected = points.size() / 8;
  VoxelHash cells(expected);
  std::vector<Tally> tallies;  // [voxels]
  voxels_.reserve(expected);
  tallies.reserve(expected);
  const Four edge = hn::Set(kFour, voxel_m_);
  const Four per_m = hn::Set(kFour, 1.0f / voxel_m_);
  const Four half = hn::Set(kFour, 0.5f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Four position = LoadPosition(points[i]);
    const Four low = FloorWithinLimits(hn::Mul(position, per_m));
    const Eigen::Vector3i cell = CellAt(low);
    const auto at =
        static_cast<std::size_t>(cells.FindOrInsert(cell, static_cast<int>(voxels_.size())));
    if (at == voxels_.size()) {
      voxels_.push_back({.cell = cell});
      tallies.emplace_back();
    }
    Tally& tally = tallies[at];
    const Four offset = hn::Sub(position, hn::Mul(hn::Add(low, half), edge));
    tally.sums.Add(offset);
    tally.count += 1.0f;
    const float squared = SumXyz(hn::Mul(offset, offset));
    if (squared >= tally.nearest) continue;
    tally.nearest = squared;
    voxels_[at].representative = static_cast<int>(i);
  }
  for (std::size_t v = 0; v < voxels_.size(); ++v) {
    Tally& tally = tallies[v];
    tally.sums.Normalize(tally.count);
    hn::Store(tally.sums.mean, kFour, voxels_[v].mean.data());
    hn::Store(tally.sums.square, kFour, voxels_[v].square.data());
    hn::Store(tally.sums.mixed, kFour, voxels_[v].mixed.data());
    voxels_[v].square[3] = tally.count;
  }
}

void VoxelMoments::SortIntoColumns() {
  columns_ = VoxelHash(voxels_.size() / 2);
  std::vector<std::uint32_t> column(voxels_.size());
  column_begin_.assign(1, 0);  // counts, shifted by one, until they are summed up
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    const Eigen::Vector3i& cell = voxels_[i].cell;
    const auto fresh = static_cast<std::uint32_t>(column_begin_.size() - 1);
    column[i] = static_cast<std::uint32_t>(
        columns_.FindOrInsert({cell.x(), cell.y(), 0}, static_cast<int>(fresh)));
    if (column[i] == fresh) column_begin_.push_back(0);
    ++column_begin_[column[i] + 1];
  }
  for (std::size_t c = 1; c < column_begin_.size(); ++c) column_begin_[c] += column_begin_[c - 1];

  std::vector<std::uint32_t> order(voxels_.size());
  std::vector<std::uint32_t> next(column_begin_.begin(), column_begin_.end() - 1);
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[next[column[i]]++] = static_cast<std::uint32_t>(i);
  }
  for (std::size_t c = 0; c + 1 < column_begin_.size(); ++c) {
    std::sort(order.begin() + column_begin_[c],
              order.begin() + column_begin_[c + 1],
              [&](std::uint32_t a, std::uint32_t b) {
                return voxels_[a].cell.z() < voxels_[b].cell.z();
              });
  }
  std::vector<Voxel> sorted;
  sorted.reserve(order.size());
  place_.resize(order.size());
  for (const std::uint32_t i : order) {
    place_[i] = static_cast<std::uint32_t>(sorted.size());
    sorted.push_back(voxels_[i]);
  }
  voxels_ = std::move(sorted);
}

/// Visits the voxels that are farther than `hole` and no farther than `radius` along some axis,
/// with the mean of each from the centre.
template <class Visit>
HWY_INLINE void VoxelMoments::ForEachAround(const Voxel& centre,
                                            int hole,
                                            int radius,
                                            Visit&& visit) const {
  const Four right = Position(voxel_m_, 0.0f, 0.0f);
  const Four ahead = Position(0.0f, voxel_m_, 0.0f);
  const Four up = Position(0.0f, 0.0f, voxel_m_);
  const auto times = [](Four v, int n) {
    return hn::Mul(v, hn::Set(kFour, static_cast<float>(n)));
  };
  for (int dx = -radius; dx <= radius; ++dx) {
    for (int dy = -radius; dy <= radius; ++dy) {
      const int column = columns_.Find({centre.cell.x() + dx, centre.cell.y() + dy, 0});
      if (column < 0) continue;
      const bool in_hole = std::max(std::abs(dx), std::abs(dy)) <= hole;
      const Four aside = hn::Add(times(right, dx), times(ahead, dy));
      const Voxel* voxel = &voxels_[column_begin_[static_cast<std::size_t>(column)]];
      const Voxel* end = voxels_.data() + column_begin_[static_cast<std::size_t>(column) + 1];
      for (; voxel != end; ++voxel) {
        const int dz = voxel->cell.z() - centre.cell.z();
        if (dz > radius) break;
        if (dz < -radius || (in_hole && std::abs(dz) <= hole)) continue;
        const Four shift = hn::Add(aside, times(up, dz));
        visit(*voxel, hn::Add(hn::Load(kFour, voxel->mean.data()), shift));
      }
    }
  }
}

/// Of the voxels around one, those off a plane fade out; twice, as they tell the plane better.
SymmetricEigen VoxelMoments::AlongPlane(const Voxel& centre,
                                        int radius,
                                        Eigen::Vector3f normal) const {
  SymmetricEigen surface;
  for (int pass = 0; pass < 2; ++pass) {
    const Plane plane{Position(normal.x(), normal.y(), normal.z()),
                      hn::Load(kFour, centre.mean.data())};
    Neighbourhood sums;
    ForEachAround(centre, -1, radius, [&](const Voxel& voxel, Four mean) {
      sums.Add(voxel, mean, plane.WeightOf(mean));
    });
    surface = sums.Decomposed();
    normal = surface.vectors.col(2).cast<float>();
  }
  return surface;
}

SymmetricEigen VoxelMoments::SurfaceAround(std::size_t voxel, int min_points) const {
  constexpr int kMinVoxels = 4;
  constexpr float kMinOwnPoints = 6.0f;
  const Voxel& centre = At(voxel);
  Neighbourhood merged;
  SymmetricEigen surface;
  int radius = 1;
  for (;; ++radius) {
    ForEachAround(centre, radius == 1 ? -1 : radius - 1, radius, [&](const Voxel& v, Four mean) {
      merged.Add(v, mean, 1.0f);
    });
    const bool is_enough =
        merged.Measurements() >= static_cast<float>(min_points) && merged.Voxels() >= kMinVoxels;
    if (!is_enough && radius < kMaxRadius) continue;
    surface = merged.Decomposed();
    if (radius == kMaxRadius || SpansASurface(surface)) break;
  }
  if (IsFlat(surface) || centre.Count() < kMinOwnPoints) return surface;
  const SymmetricEigen own = Decompose(centre.square, centre.mixed);
  if (!IsFlat(own) || !SpansASurface(own)) return surface;
  return AlongPlane(centre, radius, own.vectors.col(2).cast<float>());
}

}  // namespace covsplat
