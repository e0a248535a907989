// Tiles: one block of threads for each tile of 4 x 4 pixels. Its list is cut into segments, one for
// every half warp, whose lanes are the pixels: what a segment lets through is a product, so that
// all segments can blend at once when the products are known, and the gradient can walk all of them
// back to front at once when each one's sums are known. The two halves of a warp take the same
// turns, so that votes and sums stay within the warp. The formulas are those of cpu/rasterize.cpp.
#include "covsplat/splat/cuda/device_math.cuh"
#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

constexpr int kHalf = static_cast<int>(kTilePixels);
constexpr int kSegments = 8;
constexpr int kThreads = kSegments * kHalf;
constexpr int kBlocksPerProcessor = 6;  // leaves the gradient registers enough not to spill
constexpr int kBatch = kHalf;           // records that half a warp reads at once
constexpr int kRecordParts = static_cast<int>(sizeof(SurfelRecord<float>) / sizeof(float4));

/// The next records of a segment. `spread` puts the halves of a warp on different banks.
struct Batch {
  SurfelRecord<float> record[kBatch];
  TilePair pair[kBatch];
  float4 spread[4];
};
static_assert(sizeof(Batch) % 128 == 64);

/// What the segments of a tile know of each other, for each pixel.
struct SegmentSums {
  float survival[kSegments][kHalf];       ///< product of 1 - alpha, wherever the ray stops
  float transmittance[kSegments][kHalf];  ///< behind the segment
  float range_sum[kSegments][kHalf];
  float error_sum[kSegments][kHalf];
  float normal[3][kSegments][kHalf];
  float median[kSegments][kHalf];  ///< negative: no Gaussian here was met with more than half left
  int kept[kSegments];             ///< entries that some pixel sees
};

struct TileMemory {
  Batch batch[kSegments];
  SegmentSums sums;
};

/// A lane's place: its segment of the tile's list, its pixel and the ray through it.
struct Place {
  int segment, half, lane;  ///< half: of the warp; lane: of the half, and pixel of the tile
  std::uint32_t begin;      ///< of the segment
  int length;               ///< of the segment
  int longest;              ///< of the segments of the warp
  float3 ray;
  float column, row;  ///< of the pixel's centre, px
};

/// `length`: of the whole list.
__device__ Place FindPlace(const DeviceView& view, int tile, std::uint32_t begin, int length) {
  Place p;
  p.segment = static_cast<int>(threadIdx.x) / kHalf;
  p.half = p.segment % 2;
  p.lane = static_cast<int>(threadIdx.x) % kHalf;
  const int share = (length + kSegments - 1) / kSegments;
  const int first = min(p.segment * share, length);
  p.begin = begin + static_cast<std::uint32_t>(first);
  p.length = min(share, length - first);
  p.longest = max(p.length, __shfl_xor_sync(kWholeWarp, p.length, kHalf));
  const int x = tile % view.tile_columns;
  const int y = tile / view.tile_columns;
  const float cos_el = view.cos_elevation[kHalf * y + p.lane];
  p.ray = {cos_el * view.cos_azimuth[kHalf * x + p.lane],
           cos_el * view.sin_azimuth[kHalf * x + p.lane],
           view.sin_elevation[kHalf * y + p.lane]};
  p.column = static_cast<float>(kTileSide * x + p.lane % kTileSide) + 0.5f;
  p.row = static_cast<float>(kTileSide * y + p.lane / kTileSide) + 0.5f;
  return p;
}

/// Of a vote of the whole warp: whether anyone in the lane's half said yes.
__device__ bool AnyInHalf(unsigned votes, int half) {
  return ((votes >> (kHalf * half)) & 0xffffu) != 0;
}

/// Reads entries from `base` on, at most kBatch, unless the segments of the warp fit into one batch
/// that is there already. What is behind a segment's end is invisible.
__device__ void LoadBatch(
    const RasterJob& job, const Place& place, int base, bool first_pass, Batch& batch) {
  if (!first_pass && place.longest <= kBatch) return;
  __syncwarp();
  const int count = place.length - base;
  TilePair pair{};
  if (place.lane < count)
    pair = job.pairs[place.begin + static_cast<std::uint32_t>(base + place.lane)];
  batch.pair[place.lane] = pair;
  const auto* from = reinterpret_cast<const float4*>(job.record);
  auto* to = reinterpret_cast<float4*>(batch.record);
  for (int i = 0; i < kRecordParts; ++i) {
    const int entry = (kHalf / kRecordParts) * i + place.lane / kRecordParts;
    const std::size_t record = __shfl_sync(kWholeWarp, pair.record, entry, kHalf);
    float4 part{0.0f, 0.0f, 0.0f, 0.0f};
    if (entry < count) part = from[kRecordParts * record + place.lane % kRecordParts];
    to[kHalf * i + place.lane] = part;
  }
  __syncwarp();
}

/// Where a ray meets a Gaussian: on its surface, or within its screen-space filter.
struct Meeting {
  bool on_surface;
  float t;             ///< along the ray to the Gaussian's plane
  float u_ray, v_ray;  ///< <u, r>, <v, r>
  float a, b;          ///< in units of the Gaussian's scales
  float dx, dy;        ///< centre - pixel, px, the short way round the turn
  float alpha;
};

__device__ Meeting Meet(const DeviceView& view, const Place& p, const SurfelRecord<float>& s) {
  Meeting m;
  const float n_ray = Dot(Vector(s.n), p.ray);
  m.t = s.plane * FastReciprocal(n_ray);
  m.u_ray = Dot(Vector(s.u), p.ray);
  m.v_ray = Dot(Vector(s.v), p.ray);
  m.a = m.t * m.u_ray - s.u_c;
  m.b = m.t * m.v_ray - s.v_c;
  m.dx = s.column - p.column;
  const float turn = static_cast<float>(view.columns);
  m.dx += m.dx > 0.5f * turn ? -turn : m.dx < -0.5f * turn ? turn : 0.0f;
  m.dy = s.row - p.row;
  const float surface = m.a * m.a + m.b * m.b;
  const float filter = view.lowpass * (m.dx * m.dx + m.dy * m.dy);
  m.on_surface = fabsf(n_ray) > view.grazing_cosine && m.t > view.near_m && surface <= filter;
  const float alpha = s.opacity * __expf(-0.5f * (m.on_surface ? surface : filter));
  m.alpha = alpha > view.alpha_cap ? view.alpha_cap : alpha;  // NaN stays: it is never seen
  return m;
}

/// What ranges are compared with.
struct Measured {
  float range_m = 0.0f;
  float cap_m = 0.0f;  ///< of errors

  __device__ float ErrorOf(float range) const { return fminf(fabsf(range - range_m), cap_m); }
};

/// What a pixel has gathered so far; entries are numbered within the segment.
struct Blend {
  float transmittance = 1.0f;
  float range_sum = 0.0f;
  float error_sum = 0.0f;
  float median = -1.0f;
  float3 normal = {0.0f, 0.0f, 0.0f};
  int last_entry = -1;  ///< the last one seen
};

__device__ void BlendSurfel(const Meeting& m,
                            const SurfelRecord<float>& s,
                            const Measured& measured,
                            int entry,
                            Blend& blend) {
  const float range = m.on_surface ? m.t : s.range;
  if (blend.transmittance > 0.5f) blend.median = range;
  const float weight = m.alpha * blend.transmittance;
  blend.range_sum += weight * range;
  blend.error_sum += weight * measured.ErrorOf(range);
  blend.normal = blend.normal + weight * Vector(s.n);
  blend.transmittance -= weight;
  blend.last_entry = entry;
}

/// What a segment lets through if nothing is in front of it.
__device__ float Survival(const RasterJob& job, const Place& place, Batch& batch) {
  float survival = 1.0f;
  for (int base = 0; base < place.longest; base += kBatch) {
    LoadBatch(job, place, base, true, batch);
    const int count = min(kBatch, place.longest - base);
#pragma unroll 4
    for (int i = 0; i < count; ++i) {
      const float alpha = Meet(job.view, place, batch.record[i]).alpha;
      survival *= alpha >= job.view.alpha_min ? 1.0f - alpha : 1.0f;
    }
  }
  return survival;
}

/// Blends a segment from the transmittance in front of it. With drop_unseen the entries that some
/// pixel sees are copied, in order; returns how many there are.
__device__ int BlendSegment(const RasterJob& job,
                            const Place& place,
                            const Measured& measured,
                            Batch& batch,
                            Blend& blend) {
  int kept = 0;
  for (int base = 0; base < place.longest; base += kBatch) {
    const bool goes_on = base < place.length && blend.transmittance > job.view.transmittance_min;
    if (!__any_sync(kWholeWarp, goes_on)) break;
    LoadBatch(job, place, base, false, batch);
    const int count = min(kBatch, place.longest - base);
    for (int i = 0; i < count; ++i) {
      const SurfelRecord<float>& s = batch.record[i];
      const Meeting m = Meet(job.view, place, s);
      const bool seen =
          m.alpha >= job.view.alpha_min && blend.transmittance > job.view.transmittance_min;
      if (seen) BlendSurfel(m, s, measured, base + i, blend);
      if (!job.drop_unseen) continue;
      const unsigned votes = __ballot_sync(kWholeWarp, seen);
      if (!AnyInHalf(votes, place.half)) continue;
      if (place.lane == 0) {
        job.kept_pairs[place.begin + static_cast<std::uint32_t>(kept)] = batch.pair[i];
      }
      ++kept;
    }
  }
  return kept;
}

/// Moves the segments' kept entries together, front to back, and ends the list behind them.
__device__ void CloseGaps(
    const RasterJob& job, int tile, std::uint32_t begin, int length, const SegmentSums& sums) {
  const int lane = static_cast<int>(threadIdx.x);
  if (lane >= kWarpSize) return;
  const int share = (length + kSegments - 1) / kSegments;
  int end = 0;
  for (int segment = 0; segment < kSegments; ++segment) {
    for (int k = lane; k - lane < sums.kept[segment]; k += kWarpSize) {
      TilePair pair{};
      const bool mine = k < sums.kept[segment];
      if (mine) pair = job.kept_pairs[begin + static_cast<std::uint32_t>(segment * share + k)];
      __syncwarp();
      if (mine) job.kept_pairs[begin + static_cast<std::uint32_t>(end + k)] = pair;
      __syncwarp();
    }
    end += sums.kept[segment];
  }
  if (lane == 0) job.tile_end[tile] = begin + static_cast<std::uint32_t>(end);
}

/// A pixel of the whole list, and what the gradient needs to know of the segments around its own.
struct Blended {
  Blend all;
  Blend own;
  Blend later;  ///< sums behind the own segment; transmittance: what they take away
};

/// Blends a tile with all threads of its block.
__device__ Blended BlendTile(const RasterJob& job,
                             const Place& place,
                             const Measured& measured,
                             int tile,
                             std::uint32_t begin,
                             int length,
                             TileMemory& memory) {
  Batch& batch = memory.batch[place.segment];
  SegmentSums& sums = memory.sums;
  const int lane = place.lane;
  sums.survival[place.segment][lane] = Survival(job, place, batch);
  __syncthreads();
  Blended result;
  Blend& own = result.own;
  for (int s = 0; s < place.segment; ++s) own.transmittance *= sums.survival[s][lane];
  const int kept = BlendSegment(job, place, measured, batch, own);
  sums.transmittance[place.segment][lane] = own.transmittance;
  sums.range_sum[place.segment][lane] = own.range_sum;
  sums.error_sum[place.segment][lane] = own.error_sum;
  sums.normal[0][place.segment][lane] = own.normal.x;
  sums.normal[1][place.segment][lane] = own.normal.y;
  sums.normal[2][place.segment][lane] = own.normal.z;
  sums.median[place.segment][lane] = own.median;
  if (lane == 0) sums.kept[place.segment] = kept;
  __syncthreads();

  Blend& all = result.all;
  Blend& later = result.later;
  later.transmittance = 0.0f;
  float in_front = 1.0f;
  for (int s = 0; s < kSegments; ++s) {
    const float3 normal{sums.normal[0][s][lane], sums.normal[1][s][lane], sums.normal[2][s][lane]};
    // Behind a ray that has stopped, the product goes on but nothing is seen.
    if (in_front > job.view.transmittance_min) all.transmittance = sums.transmittance[s][lane];
    all.range_sum += sums.range_sum[s][lane];
    all.error_sum += sums.error_sum[s][lane];
    all.normal = all.normal + normal;
    if (sums.median[s][lane] >= 0.0f) all.median = sums.median[s][lane];
    if (s > place.segment) {
      later.transmittance += in_front - sums.transmittance[s][lane];
      later.error_sum += sums.error_sum[s][lane];
      later.normal = later.normal + normal;
    }
    in_front *= sums.survival[s][lane];
  }
  all.median = fmaxf(all.median, 0.0f);
  if (job.drop_unseen) CloseGaps(job, tile, begin, length, sums);
  return result;
}

/// Gradient of the loss with respect to the blended images and to the sum of errors of range.
struct ImageGradient {
  float alpha = 0.0f;
  float error_sum = 0.0f;
  float3 normal = {0.0f, 0.0f, 0.0f};
  float hidden_from = 0.0f;  ///< Gaussians from this range on have no gradient
};

struct PixelLosses {
  float term[kLossTermCount] = {0.0f, 0.0f, 0.0f};
};

/// 1 - <N / A, target>; adds to the gradient, returns the loss.
__device__ float NormalLoss(
    const Blend& blend, float inverse_alpha, float3 target, float weight, ImageGradient& g) {
  if (!(Dot(target, target) > 0.5f)) return 0.0f;
  const float cosine = Dot(target, blend.normal) * inverse_alpha;
  const float g_cosine = -weight * inverse_alpha;
  g.normal = g.normal + g_cosine * target;
  g.alpha -= g_cosine * cosine;
  return weight * (1.0f - cosine);
}

/// The pixel-local terms of the mapping loss (paper eqs. 10 to 12, the range of each Gaussian in
/// place of the rendered one) and their gradients.
__device__ PixelLosses PixelLoss(
    const StepJob& job, std::size_t pixel, float measured, const Blend& blend, ImageGradient& g) {
  PixelLosses losses;
  if (!(measured > 0.0f)) return losses;
  const DeviceView& view = job.raster.view;
  const LossWeights& weights = job.weights;
  const float alpha = 1.0f - blend.transmittance;
  const float opaque = alpha + weights.opacity_epsilon;
  g.alpha = -weights.per_opacity / opaque;
  g.hidden_from = weights.hidden_factor * measured + weights.hidden_margin_m;
  losses.term[kLossOpacity] = -weights.per_opacity * logf(fmaxf(opaque, 1e-20f));
  if (!(alpha > view.min_alpha)) return losses;

  const float inverse_alpha = 1.0f / alpha;
  const float error = blend.error_sum * inverse_alpha;
  g.error_sum = weights.per_range * inverse_alpha;
  g.alpha -= g.error_sum * error;
  losses.term[kLossRange] = weights.per_range * error;

  const std::int8_t* normal = job.targets.normal + 3 * pixel;
  const float3 target = Normalized({static_cast<float>(normal[0]),
                                    static_cast<float>(normal[1]),
                                    static_cast<float>(normal[2])});
  losses.term[kLossNormal] = NormalLoss(blend, inverse_alpha, target, weights.per_normal, g);
  if (job.targets.surface != nullptr) {
    const std::size_t pixels = kTilePixels * static_cast<std::size_t>(view.tiles);
    const float* surface = job.targets.surface + pixel;
    losses.term[kLossNormal] += NormalLoss(blend,
                                           inverse_alpha,
                                           {surface[0], surface[pixels], surface[2 * pixels]},
                                           weights.per_surface,
                                           g);
  }
  return losses;
}

/// Sums of 16 values over half a warp; lane k gets the sum of the k-th. Each round halves the
/// values that a lane is still in charge of.
__device__ float SumEach(float (&value)[kHalf], int lane) {
#pragma unroll
  for (int width = kHalf / 2; width > 0; width /= 2) {
    const bool upper = (lane & width) != 0;
#pragma unroll
    for (int i = 0; i < width; ++i) {
      const float mine = upper ? value[i + width] : value[i];
      const float other = upper ? value[i] : value[i + width];
      value[i] = mine + __shfl_xor_sync(kWholeWarp, other, width);
    }
  }
  return value[0];
}

/// Gradient of one pixel with respect to one record: the terms that a slot sums up.
/// `weight` = alpha * transmittance, `g_alpha` = alpha * dL/d alpha (zero at the cap).
__device__ void SurfelGradient(const DeviceView& view,
                               const Place& p,
                               const SurfelRecord<float>& s,
                               const Meeting& m,
                               float weight,
                               float g_alpha,
                               float g_range,
                               const ImageGradient& g,
                               float (&terms)[kHalf]) {
  const float t = m.on_surface ? m.t : 0.0f;
  const float g_surface = m.on_surface ? g_alpha : 0.0f;
  const float g_filter = view.lowpass * (g_surface - g_alpha);  // minus the filter's share
  const float g_a = -(m.a * g_surface);
  const float g_b = -(m.b * g_surface);
  const float g_t = (m.on_surface ? g_range : 0.0f) + g_a * m.u_ray + g_b * m.v_ray;
  const float g_plane = g_t * t * FastReciprocal(s.plane);  // t / plane = 1 / <n, r>
  const float3 g_u = (g_a * t) * p.ray;
  const float3 g_v = (g_b * t) * p.ray;
  const float3 g_n = weight * g.normal - (g_plane * t) * p.ray;
  terms[kSumU] = g_u.x;
  terms[kSumU + 1] = g_u.y;
  terms[kSumU + 2] = g_u.z;
  terms[kSumV] = g_v.x;
  terms[kSumV + 1] = g_v.y;
  terms[kSumV + 2] = g_v.z;
  terms[kSumNormal] = g_n.x;
  terms[kSumNormal + 1] = g_n.y;
  terms[kSumNormal + 2] = g_n.z;
  terms[kSumPlane] = g_plane;
  terms[kSumUC] = -g_a;
  terms[kSumVC] = -g_b;
  terms[kSumAlpha] = g_alpha;
  terms[kSumColumn] = g_filter * m.dx;
  terms[kSumRow] = g_filter * m.dy;
  terms[kSumRange] = m.on_surface ? 0.0f : g_range;
}

/// Walks a segment back to front with one running suffix sum per pixel. What a pixel saw on the way
/// out is found again from the record and from the last entry that it saw.
__device__ void BackSegment(const StepJob& job,
                            const Place& place,
                            const Measured& measured,
                            const Blended& blended,
                            const ImageGradient& g,
                            Batch& batch) {
  const DeviceView& view = job.raster.view;
  const Blend& own = blended.own;
  const Blend& later = blended.later;
  float transmittance = own.transmittance;
  float suffix =
      g.error_sum * later.error_sum + g.alpha * later.transmittance + Dot(g.normal, later.normal);
  for (int base = (place.longest - 1) / kBatch * kBatch; base >= 0; base -= kBatch) {
    if (!__any_sync(kWholeWarp, base <= own.last_entry)) continue;
    LoadBatch(job.raster, place, base, false, batch);
    for (int i = min(kBatch, place.longest - base) - 1; i >= 0; --i) {
      const SurfelRecord<float>& s = batch.record[i];
      const Meeting m = Meet(view, place, s);
      const int entry = base + i;
      const bool seen = m.alpha >= view.alpha_min && entry <= own.last_entry;
      const unsigned votes = __ballot_sync(kWholeWarp, seen);
      if (votes == 0) continue;
      float terms[kHalf] = {};
      if (seen) {
        const float inverse = FastReciprocal(1.0f - m.alpha);
        transmittance *= inverse;
        const float weight = m.alpha * transmittance;
        const float range = m.on_surface ? m.t : s.range;
        const float error = measured.ErrorOf(range);
        const float gained = weight * (g.error_sum * error + g.alpha + Dot(g.normal, Vector(s.n)));
        const float g_alpha = m.alpha < view.alpha_cap ? gained - suffix * inverse * m.alpha : 0.0f;
        suffix += gained;
        const float g_error = range > measured.range_m ? g.error_sum : -g.error_sum;
        const float g_range = error < measured.cap_m ? weight * g_error : 0.0f;
        if (range < g.hidden_from && (m.on_surface || job.weights.through_filter)) {
          SurfelGradient(view, place, s, m, weight, g_alpha, g_range, g, terms);
        }
      }
      const float sum = SumEach(terms, place.lane);
      if (!AnyInHalf(votes, place.half)) continue;
      const std::size_t slot = batch.pair[i].slot;
      job.slots[kTilePixels * slot + static_cast<std::size_t>(place.lane)] = sum;
      if (place.lane == 0) job.slot_used[slot] = 1;
    }
  }
}

__device__ float SumOfHalf(float value) {
  for (int width = kHalf / 2; width > 0; width /= 2) {
    value += __shfl_xor_sync(kWholeWarp, value, width);
  }
  return value;
}

__global__ void __launch_bounds__(kThreads) RenderKernel(RasterJob job, RenderImages images) {
  __shared__ TileMemory memory;
  const int tile = static_cast<int>(blockIdx.x);
  const std::uint32_t begin = job.tile_begin[tile];
  const int length = static_cast<int>(job.tile_end[tile] - begin);
  const Place place = FindPlace(job.view, tile, begin, length);
  const Blend blend = BlendTile(job, place, Measured(), tile, begin, length, memory).all;
  const int row = static_cast<int>(place.row);
  if (place.segment > 0 || row >= job.view.rows) return;
  const std::size_t pixel =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(job.view.columns) +
      static_cast<std::size_t>(place.column);
  const float alpha = 1.0f - blend.transmittance;
  const bool covered = !(alpha < job.view.min_alpha);
  const float expected = covered ? blend.range_sum / alpha : 0.0f;
  const float3 normal = Normalized(blend.normal);
  images.alpha[pixel] = alpha;
  images.range_m[pixel] =
      covered ? expected + job.view.depth_ratio * (blend.median - expected) : 0.0f;
  images.median_m[pixel] = covered ? blend.median : 0.0f;
  images.normal[3 * pixel] = covered ? normal.x : 0.0f;
  images.normal[3 * pixel + 1] = covered ? normal.y : 0.0f;
  images.normal[3 * pixel + 2] = covered ? normal.z : 0.0f;
}

/// Tiles without any measurement are left out.
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) StepKernel(StepJob job) {
  __shared__ TileMemory memory;
  const DeviceView& view = job.raster.view;
  const int tile = static_cast<int>(blockIdx.x);
  const int lane = static_cast<int>(threadIdx.x) % kHalf;
  const std::size_t pixel =
      kTilePixels * static_cast<std::size_t>(tile) + static_cast<std::size_t>(lane);
  const Measured measured{job.targets.range_step_m * static_cast<float>(job.targets.range[pixel]),
                          job.weights.range_cap_m};
  PixelLosses losses;
  if (__any_sync(kWholeWarp,
                 measured.range_m > 0.0f)) {  // both halves of all warps ask the same pixels
    const std::uint32_t begin = job.raster.tile_begin[tile];
    const int length = static_cast<int>(job.raster.tile_end[tile] - begin);
    const Place place = FindPlace(view, tile, begin, length);
    const Blended blended = BlendTile(job.raster, place, measured, tile, begin, length, memory);
    ImageGradient gradient;
    losses = PixelLoss(job, pixel, measured.range_m, blended.all, gradient);
    BackSegment(job, place, measured, blended, gradient, memory.batch[place.segment]);
  }
  if (threadIdx.x >= kWarpSize) return;
  for (int term = 0; term < kLossTermCount; ++term) {
    const float sum = SumOfHalf(losses.term[term]);
    if (threadIdx.x == 0) job.tile_losses[term * view.tiles + tile] = sum;
  }
}

constexpr int kSumThreads = 1024;

/// One block for each term adds the tiles' losses in an order that depends on nothing.
__global__ void SumLossesKernel(const float* tile_losses, int tiles, double* sums) {
  __shared__ double partial[kSumThreads];
  const float* losses = tile_losses + static_cast<std::size_t>(blockIdx.x) * tiles;
  double sum = 0.0;
  for (int i = static_cast<int>(threadIdx.x); i < tiles; i += kSumThreads) sum += losses[i];
  partial[threadIdx.x] = sum;
  for (int width = kSumThreads / 2; width > 0; width /= 2) {
    __syncthreads();
    if (static_cast<int>(threadIdx.x) < width) partial[threadIdx.x] += partial[threadIdx.x + width];
  }
  if (threadIdx.x == 0) sums[blockIdx.x] = partial[0];
}

}  // namespace

void RenderTiles(const RasterJob& job, const RenderImages& images, cudaStream_t stream) {
  RenderKernel<<<job.view.tiles, kThreads, 0, stream>>>(job, images);
  CheckLaunch("rendering");
}

void StepTiles(const StepJob& job, double* sums, cudaStream_t stream) {
  const int tiles = job.raster.view.tiles;
  StepKernel<<<tiles, kThreads, 0, stream>>>(job);
  CheckLaunch("rendering a view");
  SumLossesKernel<<<kLossTermCount, kSumThreads, 0, stream>>>(job.tile_losses, tiles, sums);
  CheckLaunch("adding up losses");
}

}  // namespace covsplat::cuda
