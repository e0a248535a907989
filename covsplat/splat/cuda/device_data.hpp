// What the host hands to the kernels: plain numbers and pointers to device memory. Device pointers
// are named for what they hold, with their shape behind.
#pragma once

#include <cstddef>
#include <cstdint>

#include "covsplat/splat/parameters.hpp"
#include "covsplat/splat/surfel_record.hpp"

namespace covsplat::cuda {

/// The sensor and the raster configuration, as ViewGeometry has them.
struct DeviceView {
  int rows, columns;
  int tile_rows, tile_columns;
  int tiles;
  const float *cos_azimuth, *sin_azimuth;      ///< [tile_columns x 16]
  const float *cos_elevation, *sin_elevation;  ///< [tile_rows x 16]
  const float* row_table;                      ///< [row_table_size]
  int row_table_size;
  float row_table_origin_rad, row_table_samples_per_rad;
  float near_m, far_m;
  float alpha_min, alpha_cap, transmittance_min;
  float lowpass, grazing_cosine, depth_ratio;
  float min_alpha;  ///< of the losses and of what a rendering shows
  bool two_sided;
};

/// Equally long columns in one piece of device memory.
struct DeviceTable {
  float* values;       ///< [columns x stride]
  std::size_t stride;  ///< rows there is room for
};

/// The Gaussians in reach of a view: record r is row `blocks[r / 16].begin + r % 16` of the table.
struct SceneJob {
  DeviceView view;
  DeviceTable gaussians;
  const GaussianBlock* blocks;               ///< [records / 16]
  const AnchorTransform<float>* transforms;  ///< indexed by the blocks
  std::uint32_t records;
  SurfelRecord<float>* record;  ///< [records]
  std::uint32_t* slot_begin;    ///< [records + 1]
};

/// Turns boxes into the tiles' lists.
struct BinJob {
  TileBox* boxes;                 ///< [records]
  std::uint32_t* tile_counts;     ///< [records + 1]: pairs of each record, 0 at the end
  std::uint32_t* record_of_slot;  ///< [pairs]
  std::uint32_t* keys;            ///< [pairs], by slot: tile above range
  std::uint32_t* slots;           ///< [pairs]
  std::uint32_t* sorted_keys;     ///< [pairs]
  std::uint32_t* sorted_slots;    ///< [pairs]
  TilePair* pairs;                ///< [pairs]
  std::uint32_t* tile_begin;      ///< [tiles]
  std::uint32_t* tile_end;        ///< [tiles]
  int range_bits;                 ///< of a key
};

/// Blends the tiles' lists. With `drop_unseen`, as in the CPU's TileJob, lists without the pairs
/// that no pixel sees are left in `kept_pairs`.
struct RasterJob {
  DeviceView view;
  const SurfelRecord<float>* record;
  const TilePair* pairs;
  TilePair* kept_pairs;
  const std::uint32_t* tile_begin;
  std::uint32_t* tile_end;
  bool drop_unseen;
};

/// Whole images, row by row. Range and median are 0 where the opacity is below `min_alpha`.
struct RenderImages {
  float* range_m;   ///< [rows x columns]
  float* median_m;  ///< [rows x columns]
  float* alpha;     ///< [rows x columns]
  float* normal;    ///< [rows x columns x 3] sensor frame, unit or zero
};

/// A training view as it is stored, tile by tile: see CompactView.
struct DeviceTargets {
  const std::uint16_t* range;  ///< [tiles x 16] in steps
  const std::int8_t* normal;   ///< [tiles x 16 x 3] any length; zero: unknown
  float range_step_m;
  const float* surface;  ///< [3 x tiles x 16] normals of the rendered surface; null: term is off
};

/// The loss's weights, divided by the numbers of pixels that they average over.
struct LossWeights {
  float per_range, per_opacity, per_normal, per_surface;
  float range_cap_m, opacity_epsilon;
  float hidden_factor, hidden_margin_m;  ///< hidden from: factor * measured range + margin
  bool through_filter;
};

/// What the 16 sums in a gradient slot are; all are linear in the ray, so that pixels just add up.
enum GradientSum : int {
  kSumU = 0,        ///< 3: with respect to u
  kSumV = 3,        ///< 3: with respect to v
  kSumNormal = 6,   ///< 3: with respect to n
  kSumPlane = 9,    ///< <n, c>
  kSumUC = 10,      ///< <u, c>
  kSumVC = 11,      ///< <v, c>
  kSumAlpha = 12,   ///< alpha * d/d alpha
  kSumColumn = 13,  ///< of the centre
  kSumRow = 14,     ///< of the centre
  kSumRange = 15    ///< of the centre
};

enum LossTerm : int { kLossRange, kLossOpacity, kLossNormal, kLossTermCount };

struct StepJob {
  RasterJob raster;
  DeviceTargets targets;
  LossWeights weights;
  float* slots;             ///< [pairs x 16]
  std::uint8_t* slot_used;  ///< [pairs]
  float* tile_losses;       ///< [kLossTermCount x tiles]
};

struct AdamRates {
  float mean_step_m, rotation_step_rad, log_scale_step, opacity_logit_step;
  float beta1, beta2, epsilon;
  float scale_weight, max_scale_m, max_log_growth;
  bool mean_along_normal;
};

struct OptimizeJob {
  SceneJob scene;
  DeviceTable moments;
  AdamRates rates;
  const float* slots;
  std::uint8_t* slot_used;    ///< cleared
  float* slot_sums;           ///< [records x 16]
  std::uint8_t* record_seen;  ///< [records]: whether any of its slots was used
};

}  // namespace covsplat::cuda
