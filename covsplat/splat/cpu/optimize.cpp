#include "covsplat/splat/cpu/optimize.hpp"

#include <cmath>
#include <numbers>

#include "covsplat/splat/cpu/rasterize.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "covsplat/splat/cpu/optimize.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "covsplat/core/simd16-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace covsplat::HWY_NAMESPACE {
namespace {

/// Gradient of 16 Gaussians with respect to their tangents; `seen` is 1 where some pixel saw one.
template <class S>
struct BlockGradient {
  Pack3<S> mean;      ///< in the anchor's frame
  Pack3<S> rotation;  ///< in the Gaussian's own frame
  Pack<S> log_scale_u, log_scale_v, opacity_logit;
  Pack3<S> normal;  ///< of the Gaussian in the anchor's frame
  Pack<S> seen;
};

/// Adds up the slots of a block's Gaussians, one row of 16 sums each. False if none was seen.
template <class S>
HWY_INLINE bool SumSlots(const OptimizeJob<S>& job, std::uint32_t number, S* rows, S* seen) {
  alignas(64) static constexpr S kNothing[16] = {};
  const std::uint32_t* slot_begin = job.bins->slot_begin.data() + kBlockSize * number;
  unsigned any = kUnseen;
  for (std::size_t lane = 0; lane < kBlockSize; ++lane) {
    Pack<S> sum = All(S(0));
    unsigned state = kUnseen;
    for (std::uint32_t slot = slot_begin[lane]; slot < slot_begin[lane + 1]; ++slot) {
      // Which slots are written is hard to guess: choose an address, not a branch.
      const bool written = job.slot_state[slot] == kWritten;
      sum = sum + LoadPack(written ? job.slots + 16 * static_cast<std::size_t>(slot) : kNothing);
      state |= job.slot_state[slot];
    }
    StorePack(sum, rows + 16 * lane);
    seen[lane] = state != kUnseen ? S(1) : S(0);
    any |= state;
  }
  return any != kUnseen;
}

template <class S>
HWY_INLINE Pack3<S> Field3(const S* by_field, int first) {
  return {LoadPack(by_field + 16 * first),
          LoadPack(by_field + 16 * (first + 1)),
          LoadPack(by_field + 16 * (first + 2))};
}

/// R^T a.
template <class S>
HWY_INLINE Pack3<S> RotateBack(const S* rotation, const Pack3<S>& a) {
  const Pack3<S> column0{All(rotation[0]), All(rotation[3]), All(rotation[6])};
  const Pack3<S> column1{All(rotation[1]), All(rotation[4]), All(rotation[7])};
  const Pack3<S> column2{All(rotation[2]), All(rotation[5]), All(rotation[8])};
  return {Dot(column0, a), Dot(column1, a), Dot(column2, a)};
}

/// Gradient with respect to the centre through its image coordinates and its range: the
/// screen-space filter's share.
template <class S>
HWY_INLINE Pack3<S> FilterGradient(const ViewGeometry<S>& view,
                                   const Pack3<S>& centre,
                                   const Pack<S>& g_column,
                                   const Pack<S>& g_row,
                                   const Pack<S>& g_range) {
  const Pack<S> horizontal2 = MulAdd(centre.x, centre.x, centre.y * centre.y);
  const Pack<S> horizontal = Sqrt(Max(horizontal2, All(S(1e-20))));
  const Pack<S> range2 = MulAdd(centre.z, centre.z, horizontal2);
  Pack<S> slope;
  const Pack<S> position = (Atan2(centre.z, horizontal) - All(view.row_table_origin_rad)) *
                           All(view.row_table_samples_per_rad);
  const S last = static_cast<S>(view.row_table.size() - 1) * S(0.9999999);
  LookUp(view.row_table.data(), Max(Min(position, All(last)), All(S(0))), slope);
  const Pack<S> g_elevation = g_row * slope * All(view.row_table_samples_per_rad);
  const Pack<S> g_azimuth =
      g_column * All(static_cast<S>(-view.columns / (2.0 * std::numbers::pi)));
  const Pack<S> around = g_azimuth / Max(horizontal2, All(S(1e-20)));
  const Pack<S> radial = g_range / Sqrt(range2);
  const Pack<S> up = g_elevation / (range2 * horizontal);
  return {MulAdd(radial, centre.x, -(around * centre.y) - up * centre.x * centre.z),
          MulAdd(radial, centre.y, around * centre.x - up * centre.y * centre.z),
          MulAdd(radial, centre.z, up * horizontal2)};
}

/// The chain rule from the sums of the slots to the tangent: algorithm 7.8 in the plane's own
/// coordinates, in which the points of rays are centre + a * axis_u + b * axis_v.
template <class S>
HWY_INLINE bool GradientOf(const OptimizeJob<S>& job, std::uint32_t number, BlockGradient<S>& out) {
  alignas(64) S rows[256];
  alignas(64) S sums[256];
  alignas(64) S fields[256];
  alignas(64) S seen[16];
  if (!SumSlots(job, number, rows, seen)) return false;
  Transpose16(rows, sums);
  Transpose16(job.records[kBlockSize * static_cast<std::size_t>(number)].u, fields);
  const auto sum = [&](int k) { return LoadPack(sums + 16 * k); };
  const Pack<S> one = All(S(1));
  // Lanes that were not seen may hold anything: keep their arithmetic finite.
  out.seen = LoadPack(seen);
  const Pack3<S> u = Field3(fields, 0);
  const Pack3<S> v = Field3(fields, 3);
  const Pack3<S> n = Field3(fields, 6);
  const Pack<S> plane = LoadPack(fields + 16 * 9);
  const Pack<S> scale_u = one / Sqrt(Max(Dot(u, u), All(S(1e-20))));
  const Pack<S> scale_v = one / Sqrt(Max(Dot(v, v), All(S(1e-20))));
  const Pack3<S> r_u = scale_u * u;
  const Pack3<S> r_v = scale_v * v;

  Pack3<S> g_centre = MulAdd(sum(kSlotA), u, sum(kSlotB) * v);
  const Pack<S> inverse_plane = one / Select(Equal(plane, All(S(0))), one, plane);
  g_centre = MulAdd(sum(kSlotTravel) * inverse_plane, n, g_centre);
  const Pack<S> g_column = sum(kSlotColumn);
  const Pack<S> g_row = sum(kSlotRow);
  const Pack<S> g_range = sum(kSlotRange);
  const Pack<S> filter = Max(Max(Abs(g_column), Abs(g_row)), Abs(g_range));
  if (!None(filter > All(S(0)))) {
    const Pack<S> u_c = scale_u * LoadPack(fields + 16 * 10);
    const Pack<S> v_c = scale_v * LoadPack(fields + 16 * 11);
    const Pack3<S> centre = MulAdd(u_c, r_u, MulAdd(v_c, r_v, plane * n));
    g_centre = g_centre + FilterGradient(*job.view, centre, g_column, g_row, g_range);
  }

  // The normal's gradient is g_normal less what tilting the plane does to the points on it.
  const Pack3<S> g_normal = Field3(sums, kSlotNormal);
  const Pack<S> tilt_u = scale_u * sum(kSlotTravelA) * inverse_plane;
  const Pack<S> tilt_v = scale_v * sum(kSlotTravelB) * inverse_plane;
  const Pack<S> facing = CopySign(one, Dot(Cross(r_u, r_v), n));  // n may be -r_u x r_v
  out.rotation = {facing * (tilt_v - Dot(r_v, g_normal)),
                  facing * (Dot(r_u, g_normal) - tilt_u),
                  sum(kSlotAB) * (scale_u / scale_v - scale_v / scale_u)};
  out.log_scale_u = sum(kSlotAA);
  out.log_scale_v = sum(kSlotBB);
  const Pack<S> opacity = LoadPack(fields + 16 * 12);
  out.opacity_logit = sum(kSlotAlpha) * (one - opacity);
  const S* rotation = job.transforms[job.blocks[number].transform].rotation;
  out.mean = RotateBack(rotation, g_centre);
  out.normal = RotateBack(rotation, n);
  return true;
}

/// Adam's state of a block while it takes a step.
template <class S>
struct AdamStep {
  const OptimizeJob<S>& job;
  std::size_t begin;
  PackMask<S> active;
  Pack<S> beta1, beta2, correction1, correction2, epsilon;

  HWY_INLINE Pack<S> First(int tangent, const Pack<S>& gradient) const {
    S* moment = job.moments->Column(kFirstMoment + tangent) + begin;
    const Pack<S> old = LoadPack(moment);
    const Pack<S> updated = MulAdd(beta1, old - gradient, gradient);
    StoreMasked(active, updated, moment);
    return updated * correction1;
  }

  /// 1 / (root of the corrected second moment + epsilon).
  HWY_INLINE Pack<S> InverseRoot(int column, const Pack<S>& squared_gradient) const {
    S* moment = job.moments->Column(column) + begin;
    const Pack<S> old = LoadPack(moment);
    const Pack<S> updated = MulAdd(beta2, old - squared_gradient, squared_gradient);
    StoreMasked(active, updated, moment);
    return All(S(1)) / (Sqrt(updated * correction2) + epsilon);
  }
};

template <class S>
HWY_INLINE AdamStep<S> BeginStep(const OptimizeJob<S>& job,
                                 std::size_t begin,
                                 const PackMask<S>& active) {
  const Pack<S> one = All(S(1));
  const Pack<S> beta1 = All(static_cast<S>(job.optimizer->beta1));
  const Pack<S> beta2 = All(static_cast<S>(job.optimizer->beta2));
  S* power1 = job.moments->Column(kBeta1Power) + begin;
  S* power2 = job.moments->Column(kBeta2Power) + begin;
  const Pack<S> next1 = LoadPack(power1) * beta1;
  const Pack<S> next2 = LoadPack(power2) * beta2;
  StoreMasked(active, next1, power1);
  StoreMasked(active, next2, power2);
  return {job,
          begin,
          active,
          beta1,
          beta2,
          one / Max(one - next1, All(S(1e-6))),
          one / Max(one - next2, All(S(1e-6))),
          All(static_cast<S>(job.optimizer->epsilon))};
}

template <class S>
HWY_INLINE void Subtract(const AdamStep<S>& step, Parameter parameter, const Pack<S>& amount) {
  S* column = step.job.gaussians->Column(parameter) + step.begin;
  StoreMasked(step.active, LoadPack(column) - amount, column);
}

template <class S>
HWY_INLINE void StepMean(const AdamStep<S>& step, const BlockGradient<S>& g) {
  Pack3<S> gradient = g.mean;
  if (step.job.optimizer->mean_along_normal) gradient = Dot(g.normal, g.mean) * g.normal;
  const Pack3<S> first{step.First(kTangentMean, gradient.x),
                       step.First(kTangentMean + 1, gradient.y),
                       step.First(kTangentMean + 2, gradient.z)};
  const Pack<S> scale = All(static_cast<S>(step.job.optimizer->mean_step_m)) *
                        step.InverseRoot(kSecondMean, Dot(gradient, gradient));
  Subtract(step, kMeanX, scale * first.x);
  Subtract(step, kMeanY, scale * first.y);
  Subtract(step, kMeanZ, scale * first.z);
}

/// q <- q * exp(-delta), to second order and renormalised.
template <class S>
HWY_INLINE void StepRotation(const AdamStep<S>& step, const BlockGradient<S>& g) {
  const Pack3<S> first{step.First(kTangentRotation, g.rotation.x),
                       step.First(kTangentRotation + 1, g.rotation.y),
                       step.First(kTangentRotation + 2, g.rotation.z)};
  const Pack<S> scale = All(static_cast<S>(-0.5 * step.job.optimizer->rotation_step_rad)) *
                        step.InverseRoot(kSecondRotation, Dot(g.rotation, g.rotation));
  const Pack3<S> d = scale * first;
  S* column[4];
  for (int i = 0; i < 4; ++i) column[i] = step.job.gaussians->Column(kQuatW + i) + step.begin;
  const Pack<S> w = LoadPack(column[0]);
  const Pack3<S> q{LoadPack(column[1]), LoadPack(column[2]), LoadPack(column[3])};
  const Pack<S> new_w = w - Dot(q, d);
  const Pack3<S> new_q = MulAdd(w, d, q) + Cross(q, d);
  const Pack<S> inverse =
      All(S(1)) / Sqrt(Max(MulAdd(new_w, new_w, Dot(new_q, new_q)), All(S(1e-20))));
  StoreMasked(step.active, new_w * inverse, column[0]);
  StoreMasked(step.active, new_q.x * inverse, column[1]);
  StoreMasked(step.active, new_q.y * inverse, column[2]);
  StoreMasked(step.active, new_q.z * inverse, column[3]);
}

/// What Adam takes away from a parameter of one number.
template <class S>
HWY_INLINE Pack<S> ScalarStep(
    const AdamStep<S>& step, int tangent, int second, double rate, const Pack<S>& gradient) {
  const Pack<S> first = step.First(tangent, gradient);
  const Pack<S> inverse = step.InverseRoot(second, gradient * gradient);
  return All(static_cast<S>(rate)) * first * inverse;
}

template <class S>
HWY_INLINE void StepLogScale(const AdamStep<S>& step,
                             Parameter parameter,
                             int tangent,
                             int second,
                             MomentColumn growth_column,
                             const Pack<S>& gradient) {
  const OptimizerConfig& optimizer = *step.job.optimizer;
  const Pack<S> amount = ScalarStep(step, tangent, second, optimizer.log_scale_step, gradient);
  S* growth = step.job.moments->Column(growth_column) + step.begin;
  const Pack<S> before = LoadPack(growth);
  const Pack<S> after = Min(before - amount, All(static_cast<S>(std::log(optimizer.max_growth))));
  StoreMasked(step.active, after, growth);
  Subtract(step, parameter, before - after);
}

template <class S>
HWY_INLINE void StepOpacity(const AdamStep<S>& step, const Pack<S>& gradient) {
  const double rate = step.job.optimizer->opacity_logit_step;
  Subtract(
      step, kOpacityLogit, ScalarStep(step, kTangentOpacityLogit, kSecondOpacity, rate, gradient));
}

/// Gradient of the scale term (paper eq. 13) on the larger of the two log scales.
template <class S>
HWY_INLINE void AddScaleTerm(const OptimizeJob<S>& job, std::size_t begin, BlockGradient<S>& g) {
  const Pack<S> scale_u = ExpBounded(LoadPack(job.gaussians->Column(kLogScaleU) + begin));
  const Pack<S> scale_v = ExpBounded(LoadPack(job.gaussians->Column(kLogScaleV) + begin));
  const Pack<S> limit = All(static_cast<S>(job.loss->max_scale_m));
  const Pack<S> weight = All(static_cast<S>(job.loss->scale));
  const auto u_larger = scale_u >= scale_v;
  const auto v_larger = scale_v > scale_u;
  g.log_scale_u = g.log_scale_u + SelectOrZero(u_larger & (scale_u > limit), weight * scale_u);
  g.log_scale_v = g.log_scale_v + SelectOrZero(v_larger & (scale_v > limit), weight * scale_v);
}

template <class S>
HWY_INLINE void OptimizeBlock(const OptimizeJob<S>& job, std::uint32_t number) {
  BlockGradient<S> gradient;
  if (!GradientOf(job, number, gradient)) return;
  const std::size_t begin = job.blocks[number].begin;
  AddScaleTerm(job, begin, gradient);
  const AdamStep<S> step = BeginStep(job, begin, gradient.seen > All(S(0)));
  StepMean(step, gradient);
  StepRotation(step, gradient);
  StepLogScale(
      step, kLogScaleU, kTangentLogScaleU, kSecondLogScaleU, kGrowthU, gradient.log_scale_u);
  StepLogScale(
      step, kLogScaleV, kTangentLogScaleV, kSecondLogScaleV, kGrowthV, gradient.log_scale_v);
  StepOpacity(step, gradient.opacity_logit);
}

template <class S>
HWY_INLINE void CollectBlock(const OptimizeJob<S>& job, std::uint32_t number) {
  BlockGradient<S> g;
  if (!GradientOf(job, number, g)) return;
  const Pack<S> columns[kTangentCount] = {g.mean.x,
                                          g.mean.y,
                                          g.mean.z,
                                          g.rotation.x,
                                          g.rotation.y,
                                          g.rotation.z,
                                          g.log_scale_u,
                                          g.log_scale_v,
                                          g.opacity_logit};
  const std::size_t begin = job.blocks[number].begin;
  const auto seen = g.seen > All(S(0));
  for (int i = 0; i < kTangentCount; ++i) {
    StoreMasked(seen, columns[i], job.gradients->Column(i) + begin);
  }
}

void OptimizeFloat(const OptimizeJob<float>& job, std::span<const std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) OptimizeBlock(job, number);
}
void OptimizeDouble(const OptimizeJob<double>& job, std::span<const std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) OptimizeBlock(job, number);
}
void CollectFloat(const OptimizeJob<float>& job, std::span<const std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) CollectBlock(job, number);
}
void CollectDouble(const OptimizeJob<double>& job, std::span<const std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) CollectBlock(job, number);
}

}  // namespace
}  // namespace covsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace covsplat {

HWY_EXPORT(OptimizeFloat);
HWY_EXPORT(OptimizeDouble);
HWY_EXPORT(CollectFloat);
HWY_EXPORT(CollectDouble);

template <>
void OptimizeBlocks<float>(const OptimizeJob<float>& job, std::span<const std::uint32_t> numbers) {
  HWY_DYNAMIC_DISPATCH(OptimizeFloat)(job, numbers);
}
template <>
void OptimizeBlocks<double>(const OptimizeJob<double>& job,
                            std::span<const std::uint32_t> numbers) {
  HWY_DYNAMIC_DISPATCH(OptimizeDouble)(job, numbers);
}
template <>
void CollectGradients<float>(const OptimizeJob<float>& job,
                             std::span<const std::uint32_t> numbers) {
  HWY_DYNAMIC_DISPATCH(CollectFloat)(job, numbers);
}
template <>
void CollectGradients<double>(const OptimizeJob<double>& job,
                              std::span<const std::uint32_t> numbers) {
  HWY_DYNAMIC_DISPATCH(CollectDouble)(job, numbers);
}

}  // namespace covsplat
#endif  // HWY_ONCE
