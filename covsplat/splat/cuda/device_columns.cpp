#include "covsplat/splat/cuda/device_columns.hpp"

#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

constexpr std::size_t kFirstRows = 4096;

/// Copies `rows` rows of `columns` columns between buffers of different strides.
void CopyRows(const float* from,
              std::size_t from_stride,
              float* to,
              std::size_t to_stride,
              std::size_t rows,
              int columns,
              cudaMemcpyKind kind,
              cudaStream_t stream) {
  if (rows == 0) return;
  CheckCuda(cudaMemcpy2DAsync(to,
                              to_stride * sizeof(float),
                              from,
                              from_stride * sizeof(float),
                              rows * sizeof(float),
                              static_cast<std::size_t>(columns),
                              kind,
                              stream),
            "copying rows");
}

}  // namespace

void DeviceColumns::Grow(std::size_t rows, cudaStream_t stream) {
  if (rows <= stride_) return;
  const std::size_t stride = std::max({rows, stride_ + stride_ / 2, kFirstRows});
  DeviceBuffer<float> grown;
  grown.Reserve(static_cast<std::size_t>(columns_) * stride);
  CopyRows(values_.Data(),
           stride_,
           grown.Data(),
           stride,
           size_,
           columns_,
           cudaMemcpyDeviceToDevice,
           stream);
  values_.Swap(grown);  // freeing the old one waits for the copy
  stride_ = stride;
}

void DeviceColumns::Append(std::span<const float> values, cudaStream_t stream) {
  const std::size_t rows = values.size() / static_cast<std::size_t>(columns_);
  Grow(size_ + rows, stream);
  CopyRows(values.data(),
           rows,
           values_.Data() + size_,
           stride_,
           rows,
           columns_,
           cudaMemcpyHostToDevice,
           stream);
  size_ += rows;
}

void DeviceColumns::Gather(const std::uint32_t* old_row, std::size_t rows, cudaStream_t stream) {
  spare_.Reserve(static_cast<std::size_t>(columns_) * stride_);
  GatherRows(Table(), columns_, old_row, rows, {spare_.Data(), stride_}, stream);
  values_.Swap(spare_);
  size_ = rows;
}

void DeviceColumns::Download(std::span<float> values, cudaStream_t stream) const {
  CopyRows(values_.Data(),
           stride_,
           values.data(),
           size_,
           size_,
           columns_,
           cudaMemcpyDeviceToHost,
           stream);
}

}  // namespace covsplat::cuda
