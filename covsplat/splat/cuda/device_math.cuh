// Vectors of three and what every kernel needs to launch.
#pragma once

#include <cuda_runtime.h>

#include "covsplat/splat/cuda/check_cuda.hpp"
#include "covsplat/splat/cuda/device_data.hpp"

namespace covsplat::cuda {

constexpr unsigned kWholeWarp = 0xffffffffu;
constexpr int kWarpSize = 32;

/// Checks the launch that was just made.
inline void CheckLaunch(const char* kernel) { CheckCuda(cudaGetLastError(), kernel); }

inline unsigned CeilDivide(std::size_t n, unsigned d) {
  return static_cast<unsigned>((n + d - 1) / d);
}

__device__ inline float& At(const DeviceTable& table, int column, std::size_t row) {
  return table.values[static_cast<std::size_t>(column) * table.stride + row];
}

__device__ inline float3 operator+(float3 a, float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
__device__ inline float3 operator-(float3 a, float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
__device__ inline float3 operator*(float s, float3 a) { return {s * a.x, s * a.y, s * a.z}; }
__device__ inline float Dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
__device__ inline float3 Cross(float3 a, float3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
__device__ inline float3 Vector(const float* v) { return {v[0], v[1], v[2]}; }
/// Zero stays zero.
__device__ inline float3 Normalized(float3 a) {
  const float squared = Dot(a, a);
  return squared > 0.0f ? (1.0f / sqrtf(squared)) * a : a;
}

/// M a and M^T a for a row-major matrix.
__device__ inline float3 Rotate(const float* m, float3 a) {
  return {Dot(Vector(m), a), Dot(Vector(m + 3), a), Dot(Vector(m + 6), a)};
}
__device__ inline float3 RotateBack(const float* m, float3 a) {
  return a.x * Vector(m) + a.y * Vector(m + 3) + a.z * Vector(m + 6);
}

/// 1 / a, good to an ulp or two; for the loops over pixels.
__device__ inline float FastReciprocal(float a) { return __fdividef(1.0f, a); }

}  // namespace covsplat::cuda
