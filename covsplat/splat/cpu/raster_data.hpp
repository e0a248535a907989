// What the stages of the CPU rasteriser hand to each other: plain arrays of one scalar type. The
// map is rendered in float; tests run the same code in double.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/core/aligned_vector.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/gaussians.hpp"
#include "covsplat/splat/splat_config.hpp"
#include "covsplat/splat/surfel_record.hpp"

namespace covsplat {

/// Constants of a sensor and a raster configuration, in the rasteriser's scalar.
template <class S>
struct ViewGeometry {
  ViewGeometry(const SensorModel& sensor, const RasterConfig& config);

  int rows = 0;
  int columns = 0;
  int tile_rows = 0;
  int tile_columns = 0;
  std::size_t Tiles() const {
    return static_cast<std::size_t>(tile_rows) * static_cast<std::size_t>(tile_columns);
  }

  // Rays are separable: (cos el cos az, cos el sin az, sin el), 16 values for each tile column or
  // tile row. Lanes below the last image row repeat it and are masked by missing targets.
  AlignedVector<S> cos_azimuth, sin_azimuth;      ///< [tile_columns x 16]
  AlignedVector<S> cos_elevation, sin_elevation;  ///< [tile_rows x 16]

  std::vector<S> row_table;
  S row_table_origin_rad;
  S row_table_samples_per_rad;

  S near_m, far_m;
  S alpha_min, alpha_cap, transmittance_min;
  S lowpass, grazing_cosine, depth_ratio;
  bool two_sided;
};

/// Where a pixel is in the tile-by-tile arrays below.
template <class S>
std::size_t PixelIndex(const ViewGeometry<S>& view, int row, int column) {
  const int tile = (row / kTileSide) * view.tile_columns + column / kTileSide;
  const int lane = (row % kTileSide) * kTileSide + column % kTileSide;
  return kTilePixels * static_cast<std::size_t>(tile) + static_cast<std::size_t>(lane);
}

/// Which Gaussians touch which tile, front to back.
struct TileBins {
  /// Those that have not been dropped from the lists.
  std::size_t ListedPairs() const;

  std::vector<std::uint32_t> tile_begin;  ///< [tiles] into pairs
  std::vector<std::uint32_t> tile_end;    ///< [tiles]
  std::vector<TilePair> pairs;
  std::vector<std::uint32_t> slot_begin;  ///< [records + 1]; empty: slots are not assigned yet
};

/// What a pass over the tiles left in a slot.
enum SlotState : std::uint8_t {
  kUnseen = 0,   ///< nothing: no pixel of its tiles sees the Gaussian
  kSeen = 1,     ///< nothing: pixels see it, but have no gradient for it
  kWritten = 3,  ///< the sums
};

/// What the 16 sums in a gradient slot are: moments over the points where the tile's rays meet the
/// plane of the Gaussian. (a, b) is such a point in units of the scales; with w = alpha *
/// transmittance, g_alpha = alpha * dL/d alpha and `travel` = t * dL/dt for the range t of the
/// point. All that a Gaussian's parameters do to its points is linear in these.
enum SlotSum : int {
  kSlotAlpha = 0,    ///< g_alpha, of rays that meet the screen-space filter as well
  kSlotA = 1,        ///< g_alpha * a
  kSlotB = 2,        ///< g_alpha * b
  kSlotAA = 3,       ///< g_alpha * a * a
  kSlotAB = 4,       ///< g_alpha * a * b
  kSlotBB = 5,       ///< g_alpha * b * b
  kSlotTravel = 6,   ///< travel
  kSlotTravelA = 7,  ///< travel * a
  kSlotTravelB = 8,  ///< travel * b
  kSlotNormal = 9,   ///< 3: w * dL/d normal
  // Of rays that meet the screen-space filter:
  kSlotColumn = 12,  ///< with respect to the column of the centre
  kSlotRow = 13,     ///< with respect to the row of the centre
  kSlotRange = 14,   ///< with respect to the range of the centre
};

/// Per-pixel sums of front-to-back blending (w = alpha * transmittance), tile by tile, 16 each.
template <class S>
struct TileImages {
  void Resize(std::size_t tiles);

  std::vector<S> transmittance;  ///< what is left of the ray: 1 - A
  std::vector<S> range_sum;      ///< sum of w * range
  std::vector<S> median;         ///< range of the last Gaussian met with transmittance > 0.5
  std::vector<S> normal_x, normal_y, normal_z;  ///< sum of w * normal, sensor frame
};

/// Gradient of a scalar with respect to every value of TileImages but the transmittance, and with
/// respect to A = 1 - transmittance.
template <class S>
struct TileGradients {
  void Resize(std::size_t tiles);

  std::vector<S> alpha, range_sum, median, normal_x, normal_y, normal_z;
};

/// A keyframe's measurements, tile by tile. Range 0: no return; normal 0: unknown.
template <class S>
struct TileTargets {
  void Resize(std::size_t tiles);

  std::vector<S> range_m;
  std::vector<S> normal_x, normal_y, normal_z;  ///< from the scan's covariances, sensor frame
  /// From the rendered surface, sensor frame; all 0 while the surface-normal term is off.
  std::vector<S> surface_x, surface_y, surface_z;
  std::size_t valid_ranges = 0;
  std::size_t valid_normals = 0;
};

/// Terms of the loss, each already weighted and averaged as it enters the total.
struct LossSums {
  double range = 0.0;
  double opacity = 0.0;
  double normal = 0.0;

  double Total() const { return range + opacity + normal; }
  LossSums& operator+=(const LossSums& other) {
    range += other.range;
    opacity += other.opacity;
    normal += other.normal;
    return *this;
  }
};

}  // namespace covsplat
