// Projection: one thread turns one Gaussian into a surfel record and a tile box. The formulas are
// those of cpu/project.cpp.
#include "covsplat/splat/cuda/kernels.hpp"
#include "covsplat/splat/cuda/surfel.cuh"

namespace covsplat::cuda {
namespace {

constexpr int kThreads = 128;

/// Rows and columns that a surfel can reach, before they become tiles.
struct Footprint {
  float half_columns, top_row, bottom_row;
};

/// Extends a footprint that contains or nearly contains the vertical axis by its bounding sphere.
__device__ void BoundBySphere(
    const DeviceView& view, float range, float radius, float elevation, Footprint& f) {
  f.half_columns = static_cast<float>(view.columns);
  const float sine = radius / range;
  if (sine >= 1.0f) {
    f.top_row = 0.0f;
    f.bottom_row = static_cast<float>(view.rows);
    return;
  }
  const float half = asinf(sine);
  f.top_row = fminf(f.top_row, RowOf(view, elevation + half) - 1.0f);
  f.bottom_row = fmaxf(f.bottom_row, RowOf(view, elevation - half) + 1.0f);
}

/// Bound of {c + a s_u r_u + b s_v r_v : a^2 + b^2 <= reach^2} by its support function along the
/// horizontal, tangential and vertical directions at the centre, united with the disc of the
/// screen-space filter.
__device__ Footprint FootprintOf(const DeviceView& view,
                                 const Surfel& s,
                                 const SurfelRecord<float>& record) {
  const float3 c = s.centre;
  const float horizontal = sqrtf(c.x * c.x + c.y * c.y);
  const float inverse = 1.0f / fmaxf(horizontal, 1e-12f);
  const float reach = sqrtf(2.0f * logf(fmaxf(s.opacity / view.alpha_min, 1.0f)));
  const float cos_az = c.x * inverse;
  const float sin_az = c.y * inverse;
  const float u_h = s.scale_u * (cos_az * s.axis_u.x + sin_az * s.axis_u.y);
  const float v_h = s.scale_v * (cos_az * s.axis_v.x + sin_az * s.axis_v.y);
  const float u_a = s.scale_u * (cos_az * s.axis_u.y - sin_az * s.axis_u.x);
  const float v_a = s.scale_v * (cos_az * s.axis_v.y - sin_az * s.axis_v.x);
  const float u_z = s.scale_u * s.axis_u.z;
  const float v_z = s.scale_v * s.axis_v.z;
  const float support_h = reach * sqrtf(u_h * u_h + v_h * v_h);
  const float support_a = reach * sqrtf(u_a * u_a + v_a * v_a);
  const float support_z = reach * sqrtf(u_z * u_z + v_z * v_z);
  const float h_low = horizontal - support_h;
  const float far_h = horizontal + support_h;
  const float h_high = sqrtf(far_h * far_h + support_a * support_a);
  const float z_high = c.z + support_z;
  const float z_low = c.z - support_z;
  const float near_h = fmaxf(h_low, 1e-6f);
  const float el_high = atan2f(z_high, z_high > 0.0f ? near_h : h_high);
  const float el_low = atan2f(z_low, z_low < 0.0f ? near_h : h_high);
  const float filter = reach / sqrtf(view.lowpass);
  const float columns_per_rad = static_cast<float>(view.columns) / (2.0f * CUDART_PI_F);
  Footprint f{fmaxf(atan2f(support_a, near_h) * columns_per_rad, filter),
              fminf(RowOf(view, el_high), record.row - filter),
              fmaxf(RowOf(view, el_low), record.row + filter)};
  if (!(h_low > 1e-6f)) {
    const float radius = reach * fmaxf(s.scale_u, s.scale_v);
    BoundBySphere(view, record.range, radius, atan2f(c.z, horizontal), f);
  }
  return f;
}

__device__ int FloorDivide(int value, int divisor) {
  return value >= 0 ? value / divisor : -((divisor - 1 - value) / divisor);
}

__device__ TileBox BoxOf(const DeviceView& view, float column, const Footprint& f) {
  const TileBox nothing{0, -1, 0, -1};
  const float half = f.half_columns + kFootprintPaddingPx;
  const float row0 = f.top_row - kFootprintPaddingPx;
  const float row1 = f.bottom_row + kFootprintPaddingPx;
  const float rows = static_cast<float>(view.rows);
  if (!(row1 > 0.0f) || !(row0 < rows)) return nothing;
  const int y0 = max(0, static_cast<int>(ceilf(fmaxf(row0, 0.0f) - 0.5f)));
  const int y1 = min(view.rows - 1, static_cast<int>(floorf(fminf(row1, rows) - 0.5f)));
  if (y1 < y0) return nothing;
  int x0 = 0;
  int x1 = kTileSide * view.tile_columns - 1;
  if (2.0f * half < static_cast<float>(view.columns - 2 * kTileSide)) {
    x0 = static_cast<int>(ceilf(column - half - 0.5f));
    x1 = static_cast<int>(floorf(column + half - 0.5f));
    if (x1 < x0) return nothing;
  }
  return {static_cast<std::int16_t>(FloorDivide(x0, kTileSide)),
          static_cast<std::int16_t>(FloorDivide(x1, kTileSide)),
          static_cast<std::int16_t>(y0 / kTileSide),
          static_cast<std::int16_t>(y1 / kTileSide)};
}

__device__ std::uint32_t TileCount(const TileBox& box) {
  return box.x1 < box.x0
             ? 0u
             : static_cast<std::uint32_t>((box.x1 - box.x0 + 1) * (box.y1 - box.y0 + 1));
}

__global__ void ProjectAllKernel(SceneJob scene, BinJob bins) {
  const std::uint32_t r = blockIdx.x * kThreads + threadIdx.x;
  if (r >= scene.records) return;
  const GaussianBlock block = scene.blocks[r / kBlockSize];
  const std::uint32_t lane = r % kBlockSize;
  TileBox box{0, -1, 0, -1};
  if (lane < block.count) {
    const Surfel surfel =
        LoadSurfel(scene.gaussians, block.begin + lane, scene.transforms[block.transform]);
    const SurfelRecord<float> record = RecordOf(scene.view, surfel);
    scene.record[r] = record;
    if (record.opacity > 0.0f) {
      box = BoxOf(scene.view, record.column, FootprintOf(scene.view, surfel, record));
    }
  }
  bins.boxes[r] = box;
  bins.tile_counts[r] = TileCount(box);
  if (r == 0) bins.tile_counts[scene.records] = 0;
}

}  // namespace

cudaError_t CheckKernels() {
  cudaFuncAttributes attributes;
  return cudaFuncGetAttributes(&attributes, ProjectAllKernel);
}

void ProjectAll(const SceneJob& scene, const BinJob& bins, cudaStream_t stream) {
  if (scene.records == 0) return;
  ProjectAllKernel<<<CeilDivide(scene.records, kThreads), kThreads, 0, stream>>>(scene, bins);
  CheckLaunch("projecting");
}

}  // namespace covsplat::cuda
