#include "covsplat/splat/cpu/rasterize.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "covsplat/splat/cpu/rasterize.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "covsplat/core/simd16-inl.hpp"

#ifndef COVSPLAT_SPLAT_CPU_RASTERIZE_ONCE
#define COVSPLAT_SPLAT_CPU_RASTERIZE_ONCE
namespace covsplat {
namespace {

/// The Gaussians that some pixel of a tile sees, kept for the way back. `range` is negative where
/// the screen-space filter was met instead of the surface.
template <class S>
struct KeptSurfels {
  std::vector<S> alpha;  ///< [16 x kept]
  std::vector<S> range;  ///< [16 x kept]
  std::vector<TilePair> pair;

  void MakeRoom(std::size_t count) {
    if (pair.size() >= count) return;
    alpha.resize(2 * 16 * count);
    range.resize(2 * 16 * count);
    pair.resize(2 * count);
  }
};

/// One for each thread, so that tiles do not allocate.
template <class S>
KeptSurfels<S>& Scratch() {
  thread_local KeptSurfels<S> kept;
  return kept;
}

}  // namespace
}  // namespace covsplat
#endif  // COVSPLAT_SPLAT_CPU_RASTERIZE_ONCE

HWY_BEFORE_NAMESPACE();
namespace covsplat::HWY_NAMESPACE {
namespace {

constexpr std::uint32_t kPrefetchAhead = 6;

/// Rays and pixel centres of one tile.
template <class S>
struct TileRays {
  Pack3<S> ray;
  Pack<S> column, row;  ///< of the pixel centres, from the tile's corner
  S corner_column, corner_row;
  S columns;  ///< of the whole image, for the wrap
};

template <class S>
HWY_INLINE TileRays<S> RaysOf(const ViewGeometry<S>& view, std::size_t tile) {
  alignas(64) static constexpr S kColumn[16] = {S(0.5),
                                                S(1.5),
                                                S(2.5),
                                                S(3.5),
                                                S(0.5),
                                                S(1.5),
                                                S(2.5),
                                                S(3.5),
                                                S(0.5),
                                                S(1.5),
                                                S(2.5),
                                                S(3.5),
                                                S(0.5),
                                                S(1.5),
                                                S(2.5),
                                                S(3.5)};
  alignas(64) static constexpr S kRow[16] = {S(0.5),
                                             S(0.5),
                                             S(0.5),
                                             S(0.5),
                                             S(1.5),
                                             S(1.5),
                                             S(1.5),
                                             S(1.5),
                                             S(2.5),
                                             S(2.5),
                                             S(2.5),
                                             S(2.5),
                                             S(3.5),
                                             S(3.5),
                                             S(3.5),
                                             S(3.5)};
  const auto tile_columns = static_cast<std::size_t>(view.tile_columns);
  const std::size_t x = tile % tile_columns;
  const std::size_t y = tile / tile_columns;
  const Pack<S> cos_el = LoadPack(&view.cos_elevation[16 * y]);
  TileRays<S> rays;
  rays.ray = {cos_el * LoadPack(&view.cos_azimuth[16 * x]),
              cos_el * LoadPack(&view.sin_azimuth[16 * x]),
              LoadPack(&view.sin_elevation[16 * y])};
  rays.column = LoadPack(kColumn);
  rays.row = LoadPack(kRow);
  rays.corner_column = static_cast<S>(x * kTileSide);
  rays.corner_row = static_cast<S>(y * kTileSide);
  rays.columns = static_cast<S>(view.columns);
  return rays;
}

/// Where the 16 rays of a tile meet one Gaussian.
template <class S>
struct Meeting {
  Pack<S> u_ray, v_ray, inverse_n_ray;  ///< <u, r>, <v, r>, 1 / <n, r>
  Pack<S> a, b;                         ///< in units of the Gaussian's scales
  Pack<S> dx, dy;                       ///< centre - pixel, px
};

template <class S>
HWY_INLINE Pack3<S> Broadcast(const S* v) {
  return {All(v[0]), All(v[1]), All(v[2])};
}

/// Offset of a Gaussian's centre from the tile's pixels, the short way round the turn.
template <class S>
HWY_INLINE void OffsetsTo(const SurfelRecord<S>& surfel, const TileRays<S>& rays, Meeting<S>& m) {
  S local = surfel.column - rays.corner_column;
  const S half = S(0.5) * rays.columns;
  local = local > half ? local - rays.columns : local < -half ? local + rays.columns : local;
  m.dx = All(local) - rays.column;
  m.dy = All(surfel.row - rays.corner_row) - rays.row;
}

/// Blending state of 16 pixels.
template <class S>
struct Blend {
  Pack<S> transmittance, range_sum, median;
  Pack<S> median_entry;  ///< number of the median Gaussian among the kept ones
  Pack3<S> normal;
};

template <class S>
HWY_INLINE Blend<S> EmptyBlend() {
  const Pack<S> zero = All(S(0));
  return {All(S(1)), zero, zero, All(S(-1)), {zero, zero, zero}};
}

/// Blends one Gaussian into the tile (algorithm: the nearer of surface and screen-space filter in
/// standard deviations). False if no pixel sees it.
template <class S>
HWY_INLINE bool BlendSurfel(const ViewGeometry<S>& view,
                            const TileRays<S>& rays,
                            const SurfelRecord<S>& s,
                            std::size_t count,
                            Blend<S>& blend,
                            KeptSurfels<S>& kept) {
  const Pack<S> n_ray = Dot(Broadcast(s.n), rays.ray);
  const auto steep = Abs(n_ray) > All(view.grazing_cosine);
  const Pack<S> t = All(s.plane) * Reciprocal(n_ray);
  Meeting<S> m;
  m.a = MulAdd(t, Dot(Broadcast(s.u), rays.ray), All(-s.u_c));
  m.b = MulAdd(t, Dot(Broadcast(s.v), rays.ray), All(-s.v_c));
  OffsetsTo(s, rays, m);
  const Pack<S> surface = MulAdd(m.a, m.a, m.b * m.b);
  const Pack<S> filter = All(view.lowpass) * MulAdd(m.dx, m.dx, m.dy * m.dy);
  const auto on_surface = steep & (t > All(view.near_m)) & (surface <= filter);
  const Pack<S> distance = Select(on_surface, surface, filter);
  const Pack<S> exponent = Max(All(S(-0.5)) * distance, All(S(-80)));
  Pack<S> alpha = Min(All(s.opacity) * ExpBounded(exponent), All(view.alpha_cap));
  const auto seen =
      (alpha >= All(view.alpha_min)) & (blend.transmittance > All(view.transmittance_min));
  if (None(seen)) return false;
  alpha = SelectOrZero(seen, alpha);
  const Pack<S> range = Select(on_surface, t, All(s.range));
  const auto takes_median = seen & (blend.transmittance > All(S(0.5)));
  blend.median = Select(takes_median, range, blend.median);
  blend.median_entry = Select(takes_median, All(static_cast<S>(count)), blend.median_entry);
  const Pack<S> weight = alpha * blend.transmittance;
  blend.range_sum = MulAdd(weight, SelectOrZero(seen, range), blend.range_sum);
  blend.normal = MulAdd(weight, Broadcast(s.n), blend.normal);
  blend.transmittance = blend.transmittance - weight;
  StorePack(alpha, &kept.alpha[16 * count]);
  StorePack(Select(on_surface, t, All(-s.range)), &kept.range[16 * count]);
  return true;
}

/// Blends a tile's list; returns how many Gaussians were kept for the way back.
template <class S>
HWY_INLINE std::size_t BlendTile(const TileJob<S>& job,
                                 std::size_t tile,
                                 const TileRays<S>& rays,
                                 Blend<S>& blend,
                                 KeptSurfels<S>& kept) {
  const std::uint32_t begin = job.bins->tile_begin[tile];
  const std::uint32_t end = job.bins->tile_end[tile];
  kept.MakeRoom(end - begin + 1);
  const TilePair* pairs = job.bins->pairs.data();
  std::size_t count = 0;
  for (std::uint32_t k = begin; k < end; ++k) {
    if (k + kPrefetchAhead < end) hwy::Prefetch(&job.records[pairs[k + kPrefetchAhead].record]);
    const SurfelRecord<S>& surfel = job.records[pairs[k].record];
    if (!BlendSurfel(*job.view, rays, surfel, count, blend, kept)) continue;
    kept.pair[count] = pairs[k];
    ++count;
    if (None(blend.transmittance > All(job.view->transmittance_min))) break;
  }
  if (job.drop_unseen) {
    std::copy_n(kept.pair.begin(), count, job.bins->pairs.begin() + begin);
    job.bins->tile_end[tile] = begin + static_cast<std::uint32_t>(count);
  }
  return count;
}

template <class S>
HWY_INLINE void StoreTile(const Blend<S>& blend, std::size_t tile, TileImages<S>& images) {
  StorePack(blend.transmittance, &images.transmittance[16 * tile]);
  StorePack(blend.range_sum, &images.range_sum[16 * tile]);
  StorePack(blend.median, &images.median[16 * tile]);
  StorePack(blend.normal.x, &images.normal_x[16 * tile]);
  StorePack(blend.normal.y, &images.normal_y[16 * tile]);
  StorePack(blend.normal.z, &images.normal_z[16 * tile]);
}

/// Gradient of the loss with respect to the blended images and to the sum of errors of range.
template <class S>
struct ImageGradient {
  Pack<S> alpha, range_sum, median;
  Pack3<S> normal;
  Pack<S> error_sum;
  Pack<S> measured, range_cap;  ///< that errors are taken of
  Pack<S> hidden_from;          ///< Gaussians from this range on have no gradient
};

template <class S>
HWY_INLINE ImageGradient<S> NoGradient() {
  const Pack<S> zero = All(S(0));
  return {
      zero, zero, zero, {zero, zero, zero}, zero, zero, zero, All(std::numeric_limits<S>::max())};
}

/// Sum of w * min(|range - measured|, cap): by how much rays miss the measurement, each of the
/// Gaussians for itself. The mean of their ranges would also be right where what lies in front
/// makes up for what lies behind.
template <class S>
HWY_INLINE Pack<S> SumOfErrors(const KeptSurfels<S>& kept,
                               std::size_t count,
                               const Pack<S>& measured,
                               const Pack<S>& cap) {
  Pack<S> transmittance = All(S(1));
  Pack<S> sum = All(S(0));
  for (std::size_t i = 0; i < count; ++i) {
    const Pack<S> weight = LoadPack(&kept.alpha[16 * i]) * transmittance;
    const Pack<S> range = Abs(LoadPack(&kept.range[16 * i]));
    sum = MulAdd(weight, Min(Abs(range - measured), cap), sum);
    transmittance = transmittance - weight;
  }
  return sum;
}

/// 1 - <N / A, target> where the target normal is known; adds to the gradient, returns the loss.
template <class S>
HWY_INLINE S NormalLoss(const Blend<S>& blend,
                        const PackMask<S>& covered,
                        const Pack<S>& inverse_alpha,
                        const Pack3<S>& target,
                        S weight,
                        ImageGradient<S>& g) {
  const auto known = covered & (Dot(target, target) > All(S(0.5)));
  const Pack<S> cosine = Dot(target, blend.normal) * inverse_alpha;
  const Pack<S> g_cosine = SelectOrZero(known, All(-weight) * inverse_alpha);
  g.normal = MulAdd(g_cosine, target, g.normal);
  g.alpha = NegMulAdd(g_cosine, cosine, g.alpha);
  return weight * SumOfLanes(SelectOrZero(known, All(S(1)) - cosine));
}

/// The pixel-local terms of the mapping loss (paper eqs. 10 to 12, the range of each Gaussian in
/// place of the rendered one) and their gradients. `count`: of the kept Gaussians.
template <class S>
HWY_INLINE LossSums PixelLoss(const TileJob<S>& job,
                              std::size_t tile,
                              const Blend<S>& blend,
                              const KeptSurfels<S>& kept,
                              std::size_t count,
                              ImageGradient<S>& g) {
  const LossConfig& loss = *job.loss;
  const TileTargets<S>& targets = *job.targets;
  const Pack<S> zero = All(S(0));
  const Pack<S> one = All(S(1));
  const S per_range = S(1) / static_cast<S>(std::max<std::size_t>(targets.valid_ranges, 1));
  const S per_normal = static_cast<S>(loss.gicp_normal) /
                       static_cast<S>(std::max<std::size_t>(targets.valid_normals, 1));
  const S per_opacity = static_cast<S>(loss.opacity) * per_range;

  const Pack<S> measured = LoadPack(&targets.range_m[16 * tile]);
  const auto valid = measured > zero;
  const Pack<S> alpha = one - blend.transmittance;
  const Pack<S> opaque = alpha + All(static_cast<S>(loss.opacity_epsilon));
  g.alpha = SelectOrZero(valid, All(-per_opacity) / opaque);
  const Pack<S> hidden_from = MulAdd(measured,
                                     All(static_cast<S>(1.0 + loss.hidden_margin_ratio)),
                                     All(static_cast<S>(loss.hidden_margin_m)));
  g.hidden_from = Select(valid, hidden_from, g.hidden_from);

  const auto covered = valid & (alpha > All(static_cast<S>(loss.min_alpha)));
  const Pack<S> inverse_alpha = one / Max(alpha, All(static_cast<S>(loss.min_alpha)));
  g.measured = measured;
  g.range_cap = All(static_cast<S>(loss.range_cap_m));
  const Pack<S> error = SumOfErrors(kept, count, measured, g.range_cap) * inverse_alpha;
  g.error_sum = SelectOrZero(covered, All(per_range) * inverse_alpha);
  g.alpha = NegMulAdd(g.error_sum, error, g.alpha);

  LossSums sums;
  const Pack3<S> normal{LoadPack(&targets.normal_x[16 * tile]),
                        LoadPack(&targets.normal_y[16 * tile]),
                        LoadPack(&targets.normal_z[16 * tile])};
  sums.normal = NormalLoss(blend, covered, inverse_alpha, normal, per_normal, g);
  if (loss.surface_normal > 0.0) {
    const Pack3<S> surface{LoadPack(&targets.surface_x[16 * tile]),
                           LoadPack(&targets.surface_y[16 * tile]),
                           LoadPack(&targets.surface_z[16 * tile])};
    const S per_surface = static_cast<S>(loss.surface_normal) * per_range;
    sums.normal += NormalLoss(blend, covered, inverse_alpha, surface, per_surface, g);
  }

  sums.range = per_range * SumOfLanes(SelectOrZero(covered, error));
  sums.opacity = -per_opacity * SumOfLanes(SelectOrZero(valid, Log(Max(opaque, All(S(1e-20))))));
  return sums;
}

template <class S>
HWY_INLINE void AddUpstream(const TileGradients<S>& upstream,
                            std::size_t tile,
                            ImageGradient<S>& g) {
  g.alpha = g.alpha + LoadPack(&upstream.alpha[16 * tile]);
  g.range_sum = g.range_sum + LoadPack(&upstream.range_sum[16 * tile]);
  g.median = g.median + LoadPack(&upstream.median[16 * tile]);
  g.normal = g.normal + Pack3<S>{LoadPack(&upstream.normal_x[16 * tile]),
                                 LoadPack(&upstream.normal_y[16 * tile]),
                                 LoadPack(&upstream.normal_z[16 * tile])};
}

/// Gradient of one kept Gaussian, summed over the tile's pixels into its slot.
/// `weight` = alpha * transmittance, `g_alpha` = alpha * dL/d alpha (zero at the cap).
template <class S>
HWY_INLINE void SurfelGradient(const ViewGeometry<S>& view,
                               const TileRays<S>& rays,
                               const SurfelRecord<S>& s,
                               const Pack<S>& kept_range,
                               const Pack<S>& weight,
                               const Pack<S>& g_alpha,
                               const Pack<S>& g_range,
                               const ImageGradient<S>& g,
                               S* slot) {
  const Pack<S> zero = All(S(0));
  const auto on_surface = kept_range > zero;
  const Pack<S> t = SelectOrZero(on_surface, kept_range);
  const Pack<S> u_ray = Dot(Broadcast(s.u), rays.ray);
  const Pack<S> v_ray = Dot(Broadcast(s.v), rays.ray);
  Meeting<S> m;
  m.a = MulAdd(t, u_ray, All(-s.u_c));
  m.b = MulAdd(t, v_ray, All(-s.v_c));
  OffsetsTo(s, rays, m);
  const Pack<S> g_surface = SelectOrZero(on_surface, g_alpha);
  const Pack<S> g_filter = All(view.lowpass) * (g_surface - g_alpha);  // minus the filter's share
  const Pack<S> g_a = -(m.a * g_surface);
  const Pack<S> g_b = -(m.b * g_surface);
  const Pack<S> g_t = SelectOrZero(on_surface, g_range) + MulAdd(g_a, u_ray, g_b * v_ray);
  const Pack<S> g_plane = g_t * t * All(S(1) / s.plane);  // t / plane = 1 / <n, r>
  const Pack<S> at = g_a * t;
  const Pack<S> bt = g_b * t;
  const Pack<S> nt = g_plane * t;
  const Pack<S> terms[16] = {at * rays.ray.x,
                             at * rays.ray.y,
                             at * rays.ray.z,
                             bt * rays.ray.x,
                             bt * rays.ray.y,
                             bt * rays.ray.z,
                             NegMulAdd(nt, rays.ray.x, weight * g.normal.x),
                             NegMulAdd(nt, rays.ray.y, weight * g.normal.y),
                             NegMulAdd(nt, rays.ray.z, weight * g.normal.z),
                             g_plane,
                             -g_a,
                             -g_b,
                             g_alpha,
                             g_filter * m.dx,
                             g_filter * m.dy,
                             Select(on_surface, zero, g_range)};
  SumEach(terms, slot);
}

/// Walks the kept Gaussians back to front with one running suffix sum.
template <class S>
HWY_INLINE void BackTile(const TileJob<S>& job,
                         const TileRays<S>& rays,
                         const Blend<S>& blend,
                         const ImageGradient<S>& g,
                         const KeptSurfels<S>& kept,
                         std::size_t count) {
  const Pack<S> zero = All(S(0));
  // A loss may leave out what only the screen-space filter shows.
  const bool through_filter = job.loss == nullptr || job.loss->through_filter;
  Pack<S> transmittance = blend.transmittance;
  Pack<S> suffix = zero;
  for (std::size_t i = count; i-- > 0;) {
    const TilePair pair = kept.pair[i];
    const SurfelRecord<S>& s = job.records[pair.record];
    const Pack<S> alpha = LoadPack(&kept.alpha[16 * i]);
    const Pack<S> kept_range = LoadPack(&kept.range[16 * i]);
    if (i >= kPrefetchAhead) {
      hwy::Prefetch(&job.records[kept.pair[i - kPrefetchAhead].record]);
      hwy::Prefetch(&job.slots[16 * kept.pair[i - kPrefetchAhead].slot]);
    }
    const auto seen = alpha > zero;
    const Pack<S> inverse = Reciprocal(All(S(1)) - alpha);
    transmittance = transmittance * inverse;
    const Pack<S> weight = alpha * transmittance;
    const Pack<S> range = Abs(kept_range);
    const Pack<S> error = range - g.measured;
    const Pack<S> value =
        MulAdd(g.error_sum, Min(Abs(error), g.range_cap), MulAdd(g.range_sum, range, g.alpha)) +
        Dot(g.normal, Broadcast(s.n));
    const Pack<S> gained = weight * value;
    auto reached = seen & (range < g.hidden_from);
    if (!through_filter) reached = reached & (kept_range > zero);
    const auto below_cap = reached & (alpha < All(job.view->alpha_cap));
    const Pack<S> g_alpha = SelectOrZero(below_cap, NegMulAdd(suffix * inverse, alpha, gained));
    suffix = suffix + gained;
    const auto is_median = seen & Equal(blend.median_entry, All(static_cast<S>(i)));
    const Pack<S> g_error =
        SelectOrZero(Abs(error) < g.range_cap, Select(error > zero, g.error_sum, -g.error_sum));
    const Pack<S> g_range = SelectOrZero(
        reached, MulAdd(weight, g.range_sum + g_error, SelectOrZero(is_median, g.median)));
    SurfelGradient(*job.view,
                   rays,
                   s,
                   kept_range,
                   SelectOrZero(reached, weight),
                   g_alpha,
                   g_range,
                   g,
                   job.slots + 16 * static_cast<std::size_t>(pair.slot));
    job.slot_used[pair.slot] = 1;
  }
}

template <class S>
HWY_INLINE bool AnyTarget(const TileTargets<S>& targets, std::size_t tile) {
  return !None(LoadPack(&targets.range_m[16 * tile]) > All(S(0)));
}

template <class S>
HWY_INLINE void RenderAll(const TileJob<S>& job, std::size_t begin, std::size_t end) {
  KeptSurfels<S>& kept = Scratch<S>();
  for (std::size_t tile = begin; tile < end; ++tile) {
    Blend<S> blend = EmptyBlend<S>();
    BlendTile(job, tile, RaysOf(*job.view, tile), blend, kept);
    StoreTile(blend, tile, *job.images);
  }
}

template <class S>
HWY_INLINE LossSums StepAll(const TileJob<S>& job, std::size_t begin, std::size_t end) {
  KeptSurfels<S>& kept = Scratch<S>();
  LossSums sums;
  for (std::size_t tile = begin; tile < end; ++tile) {
    if (job.upstream == nullptr && !AnyTarget(*job.targets, tile)) continue;
    const TileRays<S> rays = RaysOf(*job.view, tile);
    Blend<S> blend = EmptyBlend<S>();
    const std::size_t count = BlendTile(job, tile, rays, blend, kept);
    StoreTile(blend, tile, *job.images);
    ImageGradient<S> gradient = NoGradient<S>();
    if (job.targets != nullptr) sums += PixelLoss(job, tile, blend, kept, count, gradient);
    if (job.upstream != nullptr) AddUpstream(*job.upstream, tile, gradient);
    BackTile(job, rays, blend, gradient, kept, count);
  }
  return sums;
}

void RenderFloat(const TileJob<float>& job, std::size_t begin, std::size_t end) {
  RenderAll(job, begin, end);
}
void RenderDouble(const TileJob<double>& job, std::size_t begin, std::size_t end) {
  RenderAll(job, begin, end);
}
LossSums StepFloat(const TileJob<float>& job, std::size_t begin, std::size_t end) {
  return StepAll(job, begin, end);
}
LossSums StepDouble(const TileJob<double>& job, std::size_t begin, std::size_t end) {
  return StepAll(job, begin, end);
}

}  // namespace
}  // namespace covsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace covsplat {

HWY_EXPORT(RenderFloat);
HWY_EXPORT(RenderDouble);
HWY_EXPORT(StepFloat);
HWY_EXPORT(StepDouble);

template <>
void RenderTiles<float>(const TileJob<float>& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(RenderFloat)(job, begin, end);
}
template <>
void RenderTiles<double>(const TileJob<double>& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(RenderDouble)(job, begin, end);
}
template <>
LossSums StepTiles<float>(const TileJob<float>& job, std::size_t begin, std::size_t end) {
  return HWY_DYNAMIC_DISPATCH(StepFloat)(job, begin, end);
}
template <>
LossSums StepTiles<double>(const TileJob<double>& job, std::size_t begin, std::size_t end) {
  return HWY_DYNAMIC_DISPATCH(StepDouble)(job, begin, end);
}

}  // namespace covsplat
#endif  // HWY_ONCE
