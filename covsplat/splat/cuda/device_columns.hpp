// DeviceColumns: a table of Gaussians or of the optimiser's memory on the device.
#pragma once

#include <cstdint>

#include "covsplat/splat/cuda/device_buffer.hpp"
#include "covsplat/splat/cuda/device_data.hpp"

namespace covsplat::cuda {

/// Equally long columns in one buffer. All work goes into a stream.
class DeviceColumns {
 public:
  explicit DeviceColumns(int columns) : columns_(columns) {}

  /// Appends rows given column by column, [columns x rows] in pinned memory.
  void Append(std::span<const float> values, cudaStream_t stream);
  /// Row i becomes what row old_row[i] was; `old_row` is on the device.
  void Gather(const std::uint32_t* old_row, std::size_t rows, cudaStream_t stream);
  /// All rows, column by column.
  void Download(std::span<float> values, cudaStream_t stream) const;

  std::size_t Size() const { return size_; }
  DeviceTable Table() { return {values_.Data(), stride_}; }

 private:
  void Grow(std::size_t rows, cudaStream_t stream);

  int columns_;
  std::size_t size_ = 0;
  std::size_t stride_ = 0;
  DeviceBuffer<float> values_;
  DeviceBuffer<float> spare_;  ///< where gathered rows go
};

}  // namespace covsplat::cuda
