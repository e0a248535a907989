// Normals of the rendered surface: the N_surf of paper eq. 12, as surface_normals.cpp finds them.
#include "covsplat/splat/cuda/device_math.cuh"
#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

constexpr int kThreads = 128;

/// Rendered range of a pixel; 0 where there is none.
__device__ float RangeAt(const DeviceView& view, const float* range_m, int row, int column) {
  return row < 0 || row >= view.rows ? 0.0f : range_m[row * view.columns + column];
}

__device__ float3 PointAt(const DeviceView& view, int row, int column, float range) {
  const int x = static_cast<int>(kTilePixels) * (column / kTileSide) + column % kTileSide;
  const int y = static_cast<int>(kTilePixels) * (row / kTileSide) + kTileSide * (row % kTileSide);
  const float cos_el = view.cos_elevation[y];
  return {range * cos_el * view.cos_azimuth[x],
          range * cos_el * view.sin_azimuth[x],
          range * view.sin_elevation[y]};
}

__device__ float3 NormalAt(
    const DeviceView& view, float max_relative_step, const float* range_m, int row, int column) {
  const int left = column == 0 ? view.columns - 1 : column - 1;
  const int right = column + 1 == view.columns ? 0 : column + 1;
  const float centre = RangeAt(view, range_m, row, column);
  const float around[4] = {RangeAt(view, range_m, row, left),
                           RangeAt(view, range_m, row, right),
                           RangeAt(view, range_m, row - 1, column),
                           RangeAt(view, range_m, row + 1, column)};
  bool one_surface = centre > 0.0f;
  for (const float range : around) {
    one_surface = one_surface && fabsf(range - centre) < max_relative_step * centre;
  }
  if (!one_surface) return {0.0f, 0.0f, 0.0f};
  const float3 across = PointAt(view, row, right, around[1]) - PointAt(view, row, left, around[0]);
  const float3 along =
      PointAt(view, row + 1, column, around[3]) - PointAt(view, row - 1, column, around[2]);
  const float3 normal = Normalized(Cross(along, across));
  const float facing = Dot(normal, PointAt(view, row, column, centre));
  return facing < 0.0f ? normal : -1.0f * normal;
}

/// One thread per place in the tile-by-tile arrays.
__global__ void FindSurfaceNormalsKernel(DeviceView view,
                                         float max_relative_step,
                                         const float* range_m,
                                         const std::uint16_t* measured,
                                         float* surface) {
  const int pixels = static_cast<int>(kTilePixels) * view.tiles;
  const int i = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (i >= pixels) return;
  const int tile = i / static_cast<int>(kTilePixels);
  const int lane = i % static_cast<int>(kTilePixels);
  const int row = kTileSide * (tile / view.tile_columns) + lane / kTileSide;
  const int column = kTileSide * (tile % view.tile_columns) + lane % kTileSide;
  float3 normal{0.0f, 0.0f, 0.0f};
  if (measured[i] != 0) normal = NormalAt(view, max_relative_step, range_m, row, column);
  surface[i] = normal.x;
  surface[pixels + i] = normal.y;
  surface[2 * pixels + i] = normal.z;
}

}  // namespace

void FindSurfaceNormals(const DeviceView& view,
                        float max_relative_step,
                        const float* range_m,
                        const std::uint16_t* measured,
                        float* surface,
                        cudaStream_t stream) {
  const std::size_t pixels = kTilePixels * static_cast<std::size_t>(view.tiles);
  FindSurfaceNormalsKernel<<<CeilDivide(pixels, kThreads), kThreads, 0, stream>>>(
      view, max_relative_step, range_m, measured, surface);
  CheckLaunch("finding surface normals");
}

}  // namespace covsplat::cuda
