// From gradient slots to parameters. Half a warp adds up the slots of a Gaussian; then one thread
// takes it through the chain rule and a step of Adam, and projects it again. The formulas are those
// of cpu/optimize.cpp.
#include "covsplat/splat/cuda/kernels.hpp"
#include "covsplat/splat/cuda/surfel.cuh"

namespace covsplat::cuda {
namespace {

constexpr int kHalf = static_cast<int>(kTilePixels);
constexpr int kThreads = 128;
constexpr int kAtOnce = 4;  // slots that are on their way at the same time

/// Half a warp adds up the used slots of a record in their order, one sum per lane.
__global__ void __launch_bounds__(kThreads) SumSlotsKernel(OptimizeJob job) {
  const std::uint32_t record = (blockIdx.x * kThreads + threadIdx.x) / kHalf;
  if (record >= job.scene.records) return;
  const std::uint32_t lane = threadIdx.x % kHalf;
  const unsigned shift = threadIdx.x % kWarpSize - lane;
  const unsigned own_half = 0xffffu << shift;
  const std::uint32_t end = job.scene.slot_begin[record + 1];
  float sum = 0.0f;
  unsigned any = 0;
  for (std::uint32_t first = job.scene.slot_begin[record]; first < end; first += kHalf) {
    const bool used = first + lane < end && job.slot_used[first + lane] != 0;
    if (used) job.slot_used[first + lane] = 0;
    const unsigned votes = (__ballot_sync(own_half, used) & own_half) >> shift;
    any |= votes;
    const float* slot = job.slots + kHalf * static_cast<std::size_t>(first) + lane;
    for (int i = 0; votes >> i != 0; i += kAtOnce) {
      float value[kAtOnce];
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) {
        value[k] = (votes >> (i + k)) & 1u ? slot[kHalf * (i + k)] : 0.0f;
      }
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k) sum += value[k];
    }
  }
  job.slot_sums[kHalf * static_cast<std::size_t>(record) + lane] = sum;
  if (lane == 0) job.record_seen[record] = any != 0 ? 1 : 0;
}

/// Gradient of a Gaussian with respect to its tangent.
struct TangentGradient {
  float3 mean;      ///< in the anchor's frame
  float3 rotation;  ///< in the Gaussian's own frame
  float log_scale_u, log_scale_v, opacity_logit;
  float3 normal;  ///< of the Gaussian in the anchor's frame
};

/// Gradient with respect to the centre through its image coordinates and its range: the
/// screen-space filter's share.
__device__ float3
FilterGradient(const DeviceView& view, float3 centre, float g_column, float g_row, float g_range) {
  const float horizontal2 = centre.x * centre.x + centre.y * centre.y;
  const float horizontal = sqrtf(fmaxf(horizontal2, 1e-20f));
  const float range2 = centre.z * centre.z + horizontal2;
  const float position =
      (atan2f(centre.z, horizontal) - view.row_table_origin_rad) * view.row_table_samples_per_rad;
  const float last = static_cast<float>(view.row_table_size - 1) * 0.9999999f;
  const int index = static_cast<int>(fmaxf(fminf(position, last), 0.0f));
  const float slope = view.row_table[index + 1] - view.row_table[index];
  const float g_elevation = g_row * slope * view.row_table_samples_per_rad;
  const float g_azimuth = g_column * (static_cast<float>(-view.columns) / (2.0f * CUDART_PI_F));
  const float around = g_azimuth / fmaxf(horizontal2, 1e-20f);
  const float radial = g_range / sqrtf(range2);
  const float up = g_elevation / (range2 * horizontal);
  return {radial * centre.x - around * centre.y - up * centre.x * centre.z,
          radial * centre.y + around * centre.x - up * centre.y * centre.z,
          radial * centre.z + up * horizontal2};
}

/// The chain rule from a record to the Gaussian's tangent.
__device__ TangentGradient GradientOf(const DeviceView& view,
                                      const SurfelRecord<float>& s,
                                      const float* rotation,
                                      const float* sums) {
  const float3 u = Vector(s.u);
  const float3 v = Vector(s.v);
  const float3 n = Vector(s.n);
  const float inverse_u2 = 1.0f / fmaxf(Dot(u, u), 1e-20f);
  const float inverse_v2 = 1.0f / fmaxf(Dot(v, v), 1e-20f);
  // The centre from its coordinates along the orthogonal axes: u = r_u / s_u.
  const float3 centre = (s.u_c * inverse_u2) * u + (s.v_c * inverse_v2) * v + s.plane * n;
  const float3 g_u = sums[kSumUC] * centre + Vector(sums + kSumU);
  const float3 g_v = sums[kSumVC] * centre + Vector(sums + kSumV);
  const float3 g_n = sums[kSumPlane] * centre + Vector(sums + kSumNormal);
  const float3 g_centre =
      sums[kSumUC] * u + sums[kSumVC] * v + sums[kSumPlane] * n +
      FilterGradient(view, centre, sums[kSumColumn], sums[kSumRow], sums[kSumRange]);
  const float3 torque = Cross(u, g_u) + Cross(v, g_v) + Cross(n, g_n);
  const float3 r_u = sqrtf(inverse_u2) * u;
  const float3 r_v = sqrtf(inverse_v2) * v;
  return {RotateBack(rotation, g_centre),
          {Dot(r_u, torque), Dot(r_v, torque), Dot(Cross(r_u, r_v), torque)},
          -Dot(u, g_u),
          -Dot(v, g_v),
          sums[kSumAlpha] * (1.0f - s.opacity),
          RotateBack(rotation, n)};
}

/// Adam's state of a Gaussian while it takes a step.
class AdamStep {
 public:
  __device__ AdamStep(const OptimizeJob& job, std::size_t row)
      : job_(job),
        row_(row),
        correction1_(Correction(kBeta1Power, job.rates.beta1)),
        correction2_(Correction(kBeta2Power, job.rates.beta2)) {}

  __device__ float First(int tangent, float gradient) const {
    return correction1_ * Blend(kFirstMoment + tangent, job_.rates.beta1, gradient);
  }
  __device__ float3 First(int tangent, float3 g) const {
    return {First(tangent, g.x), First(tangent + 1, g.y), First(tangent + 2, g.z)};
  }

  /// 1 / (root of the corrected second moment + epsilon).
  __device__ float InverseRoot(int column, float squared_gradient) const {
    const float moment = Blend(column, job_.rates.beta2, squared_gradient);
    return 1.0f / (sqrtf(moment * correction2_) + job_.rates.epsilon);
  }

 private:
  __device__ float Correction(int column, float beta) const {
    float& power = At(job_.moments, column, row_);
    power *= beta;
    return 1.0f / fmaxf(1.0f - power, 1e-6f);
  }
  __device__ float Blend(int column, float beta, float fresh) const {
    float& moment = At(job_.moments, column, row_);
    moment = beta * (moment - fresh) + fresh;
    return moment;
  }

  const OptimizeJob& job_;
  const std::size_t row_;
  const float correction1_, correction2_;
};

__device__ void StepMean(const OptimizeJob& job,
                         const AdamStep& adam,
                         std::size_t row,
                         const TangentGradient& g) {
  float3 gradient = g.mean;
  if (job.rates.mean_along_normal) gradient = Dot(g.normal, g.mean) * g.normal;
  const float3 first = adam.First(kTangentMean, gradient);
  const float scale =
      job.rates.mean_step_m * adam.InverseRoot(kSecondMean, Dot(gradient, gradient));
  At(job.scene.gaussians, kMeanX, row) -= scale * first.x;
  At(job.scene.gaussians, kMeanY, row) -= scale * first.y;
  At(job.scene.gaussians, kMeanZ, row) -= scale * first.z;
}

/// q <- q * exp(-delta), to second order and renormalised.
__device__ void StepRotation(const OptimizeJob& job,
                             const AdamStep& adam,
                             std::size_t row,
                             const TangentGradient& g) {
  const float3 first = adam.First(kTangentRotation, g.rotation);
  const float scale = -0.5f * job.rates.rotation_step_rad *
                      adam.InverseRoot(kSecondRotation, Dot(g.rotation, g.rotation));
  const float3 d = scale * first;
  float& w = At(job.scene.gaussians, kQuatW, row);
  float& x = At(job.scene.gaussians, kQuatX, row);
  float& y = At(job.scene.gaussians, kQuatY, row);
  float& z = At(job.scene.gaussians, kQuatZ, row);
  const float3 q{x, y, z};
  const float new_w = w - Dot(q, d);
  const float3 new_q = w * d + q + Cross(q, d);
  const float inverse = 1.0f / sqrtf(fmaxf(new_w * new_w + Dot(new_q, new_q), 1e-20f));
  w = new_w * inverse;
  x = new_q.x * inverse;
  y = new_q.y * inverse;
  z = new_q.z * inverse;
}

/// What Adam takes away from a parameter of one number.
__device__ float ScalarStep(
    const AdamStep& adam, int tangent, int second, float rate, float gradient) {
  const float first = adam.First(tangent, gradient);
  return rate * first * adam.InverseRoot(second, gradient * gradient);
}

__device__ void StepLogScale(const OptimizeJob& job,
                             const AdamStep& adam,
                             std::size_t row,
                             Parameter parameter,
                             int tangent,
                             int second,
                             MomentColumn growth_column,
                             float gradient) {
  const float amount = ScalarStep(adam, tangent, second, job.rates.log_scale_step, gradient);
  float& growth = At(job.moments, growth_column, row);
  const float before = growth;
  growth = fminf(before - amount, job.rates.max_log_growth);
  At(job.scene.gaussians, parameter, row) -= before - growth;
}

__device__ void StepOpacity(const OptimizeJob& job,
                            const AdamStep& adam,
                            std::size_t row,
                            float gradient) {
  const float rate = job.rates.opacity_logit_step;
  At(job.scene.gaussians, kOpacityLogit, row) -=
      ScalarStep(adam, kTangentOpacityLogit, kSecondOpacity, rate, gradient);
}

/// Gradient of the scale term (paper eq. 13) on the larger of the two log scales.
__device__ void AddScaleTerm(const AdamRates& rates,
                             float log_scale_u,
                             float log_scale_v,
                             TangentGradient& g) {
  const float scale_u = expf(log_scale_u);
  const float scale_v = expf(log_scale_v);
  if (scale_u >= scale_v && scale_u > rates.max_scale_m) {
    g.log_scale_u += rates.scale_weight * scale_u;
  }
  if (scale_v > scale_u && scale_v > rates.max_scale_m) {
    g.log_scale_v += rates.scale_weight * scale_v;
  }
}

__global__ void __launch_bounds__(kThreads) AdamKernel(OptimizeJob job) {
  const SceneJob& scene = job.scene;
  const std::uint32_t record = blockIdx.x * kThreads + threadIdx.x;
  if (record >= scene.records || job.record_seen[record] == 0) return;
  const GaussianBlock block = scene.blocks[record / kBlockSize];
  const AnchorTransform<float>& T_sensor_anchor = scene.transforms[block.transform];
  const std::size_t row = block.begin + record % kBlockSize;
  TangentGradient gradient = GradientOf(scene.view,
                                        scene.record[record],
                                        T_sensor_anchor.rotation,
                                        job.slot_sums + kHalf * static_cast<std::size_t>(record));
  AddScaleTerm(job.rates,
               At(scene.gaussians, kLogScaleU, row),
               At(scene.gaussians, kLogScaleV, row),
               gradient);
  const AdamStep adam(job, row);
  StepMean(job, adam, row, gradient);
  StepRotation(job, adam, row, gradient);
  StepLogScale(job,
               adam,
               row,
               kLogScaleU,
               kTangentLogScaleU,
               kSecondLogScaleU,
               kGrowthU,
               gradient.log_scale_u);
  StepLogScale(job,
               adam,
               row,
               kLogScaleV,
               kTangentLogScaleV,
               kSecondLogScaleV,
               kGrowthV,
               gradient.log_scale_v);
  StepOpacity(job, adam, row, gradient.opacity_logit);
  scene.record[record] = RecordOf(scene.view, LoadSurfel(scene.gaussians, row, T_sensor_anchor));
}

}  // namespace

void Optimize(const OptimizeJob& job, cudaStream_t stream) {
  if (job.scene.records == 0) return;
  const std::size_t records = job.scene.records;
  SumSlotsKernel<<<CeilDivide(kHalf * records, kThreads), kThreads, 0, stream>>>(job);
  CheckLaunch("adding up gradients");
  AdamKernel<<<CeilDivide(records, kThreads), kThreads, 0, stream>>>(job);
  CheckLaunch("optimising");
}

}  // namespace covsplat::cuda
