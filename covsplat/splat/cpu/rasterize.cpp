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
  S* alpha;  ///< [16 x kept]
  S* range;  ///< [16 x kept]
  TilePair* pair;
};

/// Memory for them; one for each thread, so that tiles do not allocate.
template <class S>
class KeptMemory {
 public:
  static KeptMemory& OfThisThread() {
    thread_local KeptMemory memory;
    return memory;
  }

  /// For all of a tile's list, and one more that is overwritten.
  KeptSurfels<S> RoomFor(const TileBins& bins, std::size_t tile) {
    const std::size_t count = bins.tile_end[tile] - bins.tile_begin[tile] + 1;
    if (pair_.size() < count) {
      alpha_.resize(2 * 16 * count);
      range_.resize(2 * 16 * count);
      pair_.resize(2 * count);
    }
    return {alpha_.data(), range_.data(), pair_.data()};
  }

 private:
  AlignedVector<S> alpha_;
  AlignedVector<S> range_;
  std::vector<TilePair> pair_;
};

/// Constants of the inner loops, by value: for all the compiler knows, what these write might
/// change those of the view.
template <class S>
struct RayLimits {
  explicit RayLimits(const ViewGeometry<S>& view)
      : near_m(view.near_m),
        alpha_min(view.alpha_min),
        alpha_cap(view.alpha_cap),
        transmittance_min(view.transmittance_min),
        lowpass(view.lowpass),
        grazing_cosine(view.grazing_cosine) {}

  S near_m, alpha_min, alpha_cap, transmittance_min, lowpass, grazing_cosine;
};

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

template <class S>
HWY_INLINE Pack3<S> Broadcast(const S* v) {
  return {All(v[0]), All(v[1]), All(v[2])};
}

/// Column of a Gaussian's centre from the tile's corner, px, the short way round the turn.
template <class S>
HWY_INLINE S LocalColumn(const SurfelRecord<S>& surfel, const TileRays<S>& rays) {
  const S local = surfel.column - rays.corner_column;
  const S half = S(0.5) * rays.columns;
  return local > half ? local - rays.columns : local < -half ? local + rays.columns : local;
}

/// What a pass over a tile is for; it leaves out what only others need.
enum class Pass {
  kRender,  ///< the images
  kLearn,   ///< the gradient of a loss that only learns from surfaces
  kAll      ///< the images and the gradient of anything
};

/// Measured ranges of a tile's pixels, and the largest error that counts.
template <class S>
struct PixelRanges {
  Pack<S> measured, cap;
};

/// Blending state of 16 pixels.
template <class S>
struct Blend {
  Pack<S> transmittance, range_sum, median;
  Pack<S> median_entry;  ///< number of the median Gaussian among the kept ones
  Pack3<S> normal;
  PackMask<S> open;  ///< pixels whose rays go on
  /// Sum of w * min(|range - measured|, cap): by how much rays miss the measurement, each of the
  /// Gaussians for itself. The mean of their ranges would also be right where what lies in front
  /// makes up for what lies behind.
  Pack<S> error_sum;
};

template <class S>
HWY_INLINE Blend<S> EmptyBlend() {
  const Pack<S> zero = All(S(0));
  return {All(S(1)), zero, zero, All(S(-1)), {zero, zero, zero}, All(S(1)) > zero, zero};
}

/// Gaussians whose meetings with the rays are computed together. One where a pack needs several
/// vectors: these already interleave, and registers are few.
template <class S>
inline constexpr std::size_t kTogether = kParts<S> == 1 ? 2 : 1;

/// Where the rays of a tile meet some Gaussians.
template <class S, std::size_t kCount>
struct Meeting {
  Pack<S, kCount> alpha;         ///< capped, not cut
  Pack<S, kCount> range;         ///< of the ray's point on the surface, or of the centre
  Pack<S, kCount> signed_range;  ///< as in KeptSurfels
};

/// The nearer of surface and screen-space filter in standard deviations (algorithm 7.5).
template <class S, std::size_t kCount>
HWY_INLINE Meeting<S, kCount> Meet(const RayLimits<S>& limits,
                                   const TileRays<S>& rays,
                                   const SurfelRecord<S>* const (&surfels)[kCount]) {
  constexpr S kHalfLog2E = S(0.72134752044448170368);
  const auto all = [](S value) { return All<kCount>(value); };
  const auto each = [&](auto&& field) {
    return AllOfEach<kCount, S>([&](std::size_t i) { return field(*surfels[i]); });
  };
  const auto dot_ray = [&](auto&& axis) {
    const Pack3<S, kCount> a{each([&](const SurfelRecord<S>& s) { return axis(s)[0]; }),
                             each([&](const SurfelRecord<S>& s) { return axis(s)[1]; }),
                             each([&](const SurfelRecord<S>& s) { return axis(s)[2]; })};
    return Dot(a, Repeat<kCount>(rays.ray));
  };
  using Record = const SurfelRecord<S>&;
  const Pack<S, kCount> n_ray = dot_ray([](Record s) { return s.n; });
  const auto steep = n_ray < all(-limits.grazing_cosine);  // what t is positive for faces the ray
  const Pack<S, kCount> t = each([](Record s) { return s.plane; }) * Reciprocal(n_ray);
  const Pack<S, kCount> a =
      MulSub(t, dot_ray([](Record s) { return s.u; }), each([](Record s) { return s.u_c; }));
  const Pack<S, kCount> b =
      MulSub(t, dot_ray([](Record s) { return s.v; }), each([](Record s) { return s.v_c; }));
  const Pack<S, kCount> dx =
      each([&](Record s) { return LocalColumn(s, rays); }) - Repeat<kCount>(rays.column);
  const Pack<S, kCount> dy =
      each([&](Record s) { return s.row - rays.corner_row; }) - Repeat<kCount>(rays.row);
  const Pack<S, kCount> surface = MulAdd(a, a, b * b);
  const Pack<S, kCount> filter = all(limits.lowpass) * MulAdd(dx, dx, dy * dy);
  const auto on_surface = steep & (t > all(limits.near_m)) & (surface <= filter);
  const Pack<S, kCount> distance = Select(on_surface, surface, filter);
  const Pack<S, kCount> exponent = Max(all(-kHalfLog2E) * distance, all(S(-115)));
  const Pack<S, kCount> opacity = each([](Record s) { return s.opacity; });
  const Pack<S, kCount> range = each([](Record s) { return s.range; });
  return {Min(opacity * Exp2Bounded(exponent), all(limits.alpha_cap)),
          Select(on_surface, t, range),
          Select(on_surface, t, -range)};
}

/// Blends one Gaussian into the tile as number `count` of the kept ones; `met` are its values of a
/// Meeting. Returns which pixels see it.
template <Pass kPass, class S>
HWY_INLINE PackMask<S> BlendSurfel(const RayLimits<S>& limits,
                                   const PixelRanges<S>& ranges,
                                   const SurfelRecord<S>& s,
                                   const Meeting<S, 1>& met,
                                   std::size_t count,
                                   Blend<S>& blend,
                                   const KeptSurfels<S>& kept) {
  const auto seen = (met.alpha >= All(limits.alpha_min)) & blend.open;
  const Pack<S> alpha = SelectOrZero(seen, met.alpha);
  const Pack<S> weight = alpha * blend.transmittance;
  blend.normal = MulAdd(weight, Broadcast(s.n), blend.normal);
  if constexpr (kPass != Pass::kLearn) {
    const auto takes_median = seen & (blend.transmittance > All(S(0.5)));
    blend.median = Select(takes_median, met.range, blend.median);
    blend.range_sum = MulAdd(weight, met.range, blend.range_sum);
    if constexpr (kPass == Pass::kAll) {
      blend.median_entry = Select(takes_median, All(static_cast<S>(count)), blend.median_entry);
    }
  }
  if constexpr (kPass != Pass::kRender) {
    const Pack<S> error = Min(Abs(met.range - ranges.measured), ranges.cap);
    blend.error_sum = MulAdd(weight, error, blend.error_sum);
    StorePack(alpha, &kept.alpha[16 * count]);
    StorePack(met.signed_range, &kept.range[16 * count]);
  }
  blend.transmittance = blend.transmittance - weight;
  blend.open = blend.transmittance > All(limits.transmittance_min);
  return seen;
}

/// Blends a tile's list; returns how many Gaussians were kept for the way back.
template <Pass kPass, class S>
HWY_INLINE std::size_t BlendTile(const TileJob<S>& job,
                                 std::size_t tile,
                                 const TileRays<S>& rays,
                                 const PixelRanges<S>& ranges,
                                 Blend<S>& blend,
                                 const KeptSurfels<S>& kept) {
  const RayLimits<S> limits(*job.view);
  const SurfelRecord<S>* const records = job.records;
  TilePair* const pairs = job.bins->pairs.data();
  const std::uint32_t begin = job.bins->tile_begin[tile];
  const std::uint32_t end = job.bins->tile_end[tile];
  std::size_t count = 0;
  for (std::uint32_t k = begin; k < end; k += kTogether<S>) {
    const SurfelRecord<S>* surfels[kTogether<S>];
    for (std::uint32_t i = 0; i < kTogether<S>; ++i) {
      surfels[i] = &records[pairs[std::min(k + i, end - 1)].record];
      hwy::Prefetch(&records[pairs[std::min(k + i + kPrefetchAhead, end - 1)].record]);
    }
    const Meeting<S, kTogether<S>> met = Meet<S>(limits, rays, surfels);
    for (std::uint32_t i = 0; i < kTogether<S> && k + i < end; ++i) {
      const Meeting<S, 1> one{Nth(met.alpha, i), Nth(met.range, i), Nth(met.signed_range, i)};
      const auto seen = BlendSurfel<kPass>(limits, ranges, *surfels[i], one, count, blend, kept);
      // What is not seen is overwritten by the next one: cheaper than a branch that is often wrong.
      kept.pair[count] = pairs[k + i];
      count += None(seen) ? 0 : 1;
    }
    if (None(blend.open)) break;
  }
  if (job.drop_unseen) {
    std::copy_n(kept.pair, count, pairs + begin);
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
  Pack<S> hidden_from;  ///< Gaussians from this range on have no gradient
};

template <class S>
HWY_INLINE ImageGradient<S> NoGradient() {
  const Pack<S> zero = All(S(0));
  return {zero, zero, zero, {zero, zero, zero}, zero, All(std::numeric_limits<S>::max())};
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
/// place of the rendered one) and their gradients.
template <class S>
HWY_INLINE LossSums PixelLoss(const TileJob<S>& job,
                              std::size_t tile,
                              const PixelRanges<S>& ranges,
                              const Blend<S>& blend,
                              ImageGradient<S>& g) {
  const LossConfig& loss = *job.loss;
  const TileTargets<S>& targets = *job.targets;
  const Pack<S> zero = All(S(0));
  const Pack<S> one = All(S(1));
  const S per_range = S(1) / static_cast<S>(std::max<std::size_t>(targets.valid_ranges, 1));
  const S per_normal = static_cast<S>(loss.gicp_normal) /
                       static_cast<S>(std::max<std::size_t>(targets.valid_normals, 1));
  const S per_opacity = static_cast<S>(loss.opacity) * per_range;

  const auto valid = ranges.measured > zero;
  const Pack<S> alpha = one - blend.transmittance;
  const Pack<S> opaque = alpha + All(static_cast<S>(loss.opacity_epsilon));
  g.alpha = SelectOrZero(valid, All(-per_opacity) / opaque);
  const Pack<S> hidden_from = MulAdd(ranges.measured,
                                     All(static_cast<S>(1.0 + loss.hidden_margin_ratio)),
                                     All(static_cast<S>(loss.hidden_margin_m)));
  g.hidden_from = Select(valid, hidden_from, g.hidden_from);

  const auto covered = valid & (alpha > All(static_cast<S>(loss.min_alpha)));
  const Pack<S> inverse_alpha = one / Max(alpha, All(static_cast<S>(loss.min_alpha)));
  const Pack<S> error = blend.error_sum * inverse_alpha;
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

/// Gradient of 16 pixels with respect to one Gaussian; zero where it has none.
template <class S>
struct RayGradient {
  Pack<S> weight;  ///< alpha * transmittance
  Pack<S> alpha;   ///< alpha * dL/d alpha
  Pack<S> range;   ///< dL/d range
};

/// Adds the gradient of one kept Gaussian, summed over the tile's pixels, to the sums `before` into
/// its slot. `kept_range`: as in KeptSurfels.
template <Pass kPass, class S>
HWY_INLINE void SumSurfelGradient(S lowpass,
                                  const TileRays<S>& rays,
                                  const SurfelRecord<S>& s,
                                  const Pack<S>& kept_range,
                                  const RayGradient<S>& ray,
                                  const Pack3<S>& g_normal,
                                  const S* before,
                                  S* slot) {
  const auto on_surface = kept_range > All(S(0));
  // A pass that only learns from surfaces has no other rays with a gradient.
  const auto of_surface = [&](const Pack<S>& value) {
    return kPass == Pass::kLearn ? value : SelectOrZero(on_surface, value);
  };
  const Pack<S> t = of_surface(kept_range);
  const Pack<S> t_u_ray = t * Dot(Broadcast(s.u), rays.ray);
  const Pack<S> t_v_ray = t * Dot(Broadcast(s.v), rays.ray);
  const Pack<S> a = t_u_ray - All(s.u_c);
  const Pack<S> b = t_v_ray - All(s.v_c);
  const Pack<S> g_alpha = of_surface(ray.alpha);
  const Pack<S> g_a = g_alpha * a;
  const Pack<S> g_b = g_alpha * b;
  const Pack<S> travel =
      NegMulAdd(g_a, t_u_ray, NegMulAdd(g_b, t_v_ray, of_surface(ray.range) * t));
  const Pack<S> terms[12] = {ray.alpha,
                             g_a,
                             g_b,
                             g_a * a,
                             g_a * b,
                             g_b * b,
                             travel,
                             travel * a,
                             travel * b,
                             ray.weight * g_normal.x,
                             ray.weight * g_normal.y,
                             ray.weight * g_normal.z};
  AddSumOfEach(terms, before, slot);
  const Pack<S> zero = All(S(0));
  if constexpr (kPass == Pass::kLearn) {
    StoreZeros<4>(slot + kSlotColumn);
  } else {
    const Pack<S> dx = All(LocalColumn(s, rays)) - rays.column;
    const Pack<S> dy = All(s.row - rays.corner_row) - rays.row;
    const Pack<S> g_filter = All(-lowpass) * Select(on_surface, zero, ray.alpha);
    const Pack<S> filter_terms[4] = {
        g_filter * dx, g_filter * dy, Select(on_surface, zero, ray.range), zero};
    AddSumOfEach(filter_terms, before + kSlotColumn, slot + kSlotColumn);
  }
}

/// Walks the kept Gaussians back to front with one running suffix sum.
template <Pass kPass, class S>
HWY_INLINE void BackTile(const TileJob<S>& job,
                         const TileRays<S>& rays,
                         const PixelRanges<S>& ranges,
                         const Blend<S>& blend,
                         const ImageGradient<S>& g,
                         const KeptSurfels<S>& kept,
                         std::size_t count) {
  alignas(64) static constexpr S kNothing[16] = {};
  const Pack<S> zero = All(S(0));
  // A loss may leave out what only the screen-space filter shows.
  const bool through_filter =
      kPass != Pass::kLearn && (job.loss == nullptr || job.loss->through_filter);
  const RayLimits<S> limits(*job.view);
  const SurfelRecord<S>* const records = job.records;
  S* const slots = job.slots;
  SlotState* const slot_state = job.slot_state;
  Pack<S> transmittance = blend.transmittance;
  Pack<S> suffix = zero;
  for (std::size_t i = count; i-- > 0;) {
    const TilePair pair = kept.pair[i];
    const SurfelRecord<S>& s = records[pair.record];
    const Pack<S> alpha = LoadPack(&kept.alpha[16 * i]);
    const Pack<S> kept_range = LoadPack(&kept.range[16 * i]);
    if (i >= kPrefetchAhead) {
      hwy::Prefetch(&slots[16 * static_cast<std::size_t>(kept.pair[i - kPrefetchAhead].slot)]);
    }
    const Pack<S> inverse = Reciprocal(All(S(1)) - alpha);
    transmittance = transmittance * inverse;
    const Pack<S> weight = alpha * transmittance;
    const Pack<S> range = Abs(kept_range);
    const Pack<S> error = range - ranges.measured;
    const Pack<S> miss = Abs(error);
    Pack<S> value = MulAdd(g.error_sum, Min(miss, ranges.cap), g.alpha);
    if constexpr (kPass == Pass::kAll) value = MulAdd(g.range_sum, range, value);
    value = DotAdd(g.normal, Broadcast(s.n), value);
    const Pack<S> gained = weight * value;
    const Pack<S> behind = suffix;
    suffix = suffix + gained;
    auto reached = (alpha > zero) & (range < g.hidden_from);
    if (!through_filter) reached = reached & (kept_range > zero);
    SlotState& state = slot_state[pair.slot];
    if (None(reached)) {
      state = std::max(state, kSeen);
      continue;
    }
    S* slot = slots + 16 * static_cast<std::size_t>(pair.slot);
    // Whether tiles before have written is hard to guess: choose an address, not a branch.
    const S* before = state == kWritten ? slot : kNothing;
    state = kWritten;
    const auto below_cap = reached & (alpha < All(limits.alpha_cap));
    const auto in_cap = reached & (miss < ranges.cap);
    RayGradient<S> ray;
    ray.weight = SelectOrZero(reached, weight);
    ray.alpha = SelectOrZero(below_cap, NegMulAdd(behind * inverse, alpha, gained));
    ray.range = SelectOrZero(in_cap, weight * CopySign(g.error_sum, error));
    if constexpr (kPass == Pass::kAll) {
      const auto is_median = reached & Equal(blend.median_entry, All(static_cast<S>(i)));
      ray.range = ray.range + MulAdd(ray.weight, g.range_sum, SelectOrZero(is_median, g.median));
    }
    SumSurfelGradient<kPass>(limits.lowpass, rays, s, kept_range, ray, g.normal, before, slot);
  }
}

template <class S>
HWY_INLINE bool AnyTarget(const TileTargets<S>& targets, std::size_t tile) {
  return !None(LoadPack(&targets.range_m[16 * tile]) > All(S(0)));
}

template <class S>
HWY_INLINE PixelRanges<S> RangesOf(const TileJob<S>& job, std::size_t tile) {
  if (job.targets == nullptr) return {All(S(0)), All(S(0))};
  return {LoadPack(&job.targets->range_m[16 * tile]), All(static_cast<S>(job.loss->range_cap_m))};
}

template <class S>
HWY_INLINE void RenderAll(const TileJob<S>& job, std::size_t begin, std::size_t end) {
  KeptMemory<S>& memory = KeptMemory<S>::OfThisThread();
  const PixelRanges<S> no_ranges{All(S(0)), All(S(0))};
  for (std::size_t tile = begin; tile < end; ++tile) {
    Blend<S> blend = EmptyBlend<S>();
    const KeptSurfels<S> kept = memory.RoomFor(*job.bins, tile);
    BlendTile<Pass::kRender>(job, tile, RaysOf(*job.view, tile), no_ranges, blend, kept);
    StoreTile(blend, tile, *job.images);
  }
}

template <Pass kPass, class S>
HWY_INLINE LossSums StepAll(const TileJob<S>& job, std::size_t begin, std::size_t end) {
  KeptMemory<S>& memory = KeptMemory<S>::OfThisThread();
  LossSums sums;
  for (std::size_t tile = begin; tile < end; ++tile) {
    if (job.upstream == nullptr && !AnyTarget(*job.targets, tile)) continue;
    const TileRays<S> rays = RaysOf(*job.view, tile);
    const PixelRanges<S> ranges = RangesOf(job, tile);
    Blend<S> blend = EmptyBlend<S>();
    const KeptSurfels<S> kept = memory.RoomFor(*job.bins, tile);
    const std::size_t count = BlendTile<kPass>(job, tile, rays, ranges, blend, kept);
    if constexpr (kPass == Pass::kAll) StoreTile(blend, tile, *job.images);
    ImageGradient<S> gradient = NoGradient<S>();
    if (job.targets != nullptr) sums += PixelLoss(job, tile, ranges, blend, gradient);
    if (job.upstream != nullptr) AddUpstream(*job.upstream, tile, gradient);
    BackTile<kPass>(job, rays, ranges, blend, gradient, kept, count);
  }
  return sums;
}

template <class S>
HWY_INLINE LossSums Step(const TileJob<S>& job, std::size_t begin, std::size_t end) {
  const bool learns_from_surfaces = job.upstream == nullptr && !job.loss->through_filter;
  return learns_from_surfaces ? StepAll<Pass::kLearn>(job, begin, end)
                              : StepAll<Pass::kAll>(job, begin, end);
}

void RenderFloat(const TileJob<float>& job, std::size_t begin, std::size_t end) {
  RenderAll(job, begin, end);
}
void RenderDouble(const TileJob<double>& job, std::size_t begin, std::size_t end) {
  RenderAll(job, begin, end);
}
LossSums StepFloat(const TileJob<float>& job, std::size_t begin, std::size_t end) {
  return Step(job, begin, end);
}
LossSums StepDouble(const TileJob<double>& job, std::size_t begin, std::size_t end) {
  return Step(job, begin, end);
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
