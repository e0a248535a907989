// Rows of tables on the device: written and moved.
#include "covsplat/splat/cuda/device_math.cuh"
#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

constexpr int kThreads = 256;

__global__ void GatherRowsKernel(DeviceTable from,
                                 const std::uint32_t* old_row,
                                 std::uint32_t rows,
                                 DeviceTable to) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  const int column = static_cast<int>(blockIdx.y);
  if (i < rows) At(to, column, i) = At(from, column, old_row[i]);
}

}  // namespace

void GatherRows(const DeviceTable& from,
                int columns,
                const std::uint32_t* old_row,
                std::size_t rows,
                const DeviceTable& to,
                cudaStream_t stream) {
  if (rows == 0) return;
  const dim3 blocks(CeilDivide(rows, kThreads), static_cast<unsigned>(columns));
  GatherRowsKernel<<<blocks, kThreads, 0, stream>>>(
      from, old_row, static_cast<std::uint32_t>(rows), to);
  CheckLaunch("moving rows");
}

}  // namespace covsplat::cuda
