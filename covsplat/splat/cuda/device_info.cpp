#include "covsplat/splat/cuda/device_info.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>

#include "covsplat/splat/cuda/device_buffer.hpp"
#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

std::atomic<std::ptrdiff_t> device_bytes = 0;

}  // namespace

void CheckCuda(cudaError_t status, const char* what) {
  if (status == cudaSuccess) return;
  std::fprintf(stderr,
               "covsplat: CUDA failed at %s: %s%s\n",
               what,
               cudaGetErrorString(status),
               status == cudaErrorMemoryAllocation ? "; use --backend cpu, or a smaller map" : "");
  std::abort();
}

void CountDeviceBytes(std::ptrdiff_t bytes) { device_bytes += bytes; }

std::size_t DeviceBytes() { return static_cast<std::size_t>(device_bytes.load()); }

Result<std::string> FindDevice() {
  int devices = 0;
  const cudaError_t counted = cudaGetDeviceCount(&devices);
  if (counted != cudaSuccess || devices == 0) {
    static_cast<void>(cudaGetLastError());
    return Fail(ErrorCode::kUnavailable,
                "no CUDA device: {}",
                counted != cudaSuccess ? cudaGetErrorString(counted) : "none is installed");
  }
  cudaDeviceProp properties;
  int device = 0;
  CheckCuda(cudaGetDevice(&device), "asking for the device");
  CheckCuda(cudaGetDeviceProperties(&properties, device), "asking for the device's properties");
  if (const cudaError_t code = CheckKernels(); code != cudaSuccess) {
    static_cast<void>(cudaGetLastError());
    return Fail(ErrorCode::kUnavailable,
                "the CUDA device {} (compute capability {}.{}) cannot run this build: {}",
                properties.name,
                properties.major,
                properties.minor,
                cudaGetErrorString(code));
  }
  return std::string(properties.name);
}

double MeasureCopyBandwidth() {
  constexpr std::size_t kBytes = std::size_t{1} << 30;
  constexpr int kRepeats = 10;
  DeviceBuffer<char> from;
  DeviceBuffer<char> to;
  from.Reserve(kBytes);
  to.Reserve(kBytes);
  const Stream stream;
  cudaEvent_t begin = nullptr;
  cudaEvent_t end = nullptr;
  CheckCuda(cudaEventCreate(&begin), "an event");
  CheckCuda(cudaEventCreate(&end), "an event");
  float best_ms = 0.0f;
  for (int i = 0; i < kRepeats; ++i) {
    CheckCuda(cudaEventRecord(begin, stream), "an event");
    CheckCuda(cudaMemcpyAsync(to.Data(), from.Data(), kBytes, cudaMemcpyDeviceToDevice, stream),
              "copying within the device");
    CheckCuda(cudaEventRecord(end, stream), "an event");
    stream.Wait();
    float ms = 0.0f;
    CheckCuda(cudaEventElapsedTime(&ms, begin, end), "an event");
    best_ms = i == 0 ? ms : std::min(best_ms, ms);
  }
  cudaEventDestroy(begin);
  cudaEventDestroy(end);
  return 2.0 * static_cast<double>(kBytes) / (1e-3 * static_cast<double>(best_ms));
}

}  // namespace covsplat::cuda
