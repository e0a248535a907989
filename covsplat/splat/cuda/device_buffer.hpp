// Memory on the device, and pinned memory of the host that copies from and to it without waiting.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include <cuda_runtime_api.h>

#include "covsplat/splat/cuda/check_cuda.hpp"

namespace covsplat::cuda {

/// Adds to what DeviceBytes() reports.
void CountDeviceBytes(std::ptrdiff_t bytes);

/// Values on the device. What has to grow grows by half more than is asked for, so that steps
/// hardly ever allocate.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  ~DeviceBuffer() { Free(); }
  DeviceBuffer(DeviceBuffer&& other) noexcept { Swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    Swap(other);
    return *this;
  }

  /// Makes room; what was there is lost if the buffer has to grow.
  void Reserve(std::size_t size) {
    if (size <= capacity_) return;
    const std::size_t capacity = capacity_ == 0 ? size : size + size / 2;
    Free();
    capacity_ = capacity;
    void* memory = nullptr;
    CheckCuda(cudaMalloc(&memory, capacity_ * sizeof(T)), "allocating device memory");
    data_ = static_cast<T*>(memory);
    CountDeviceBytes(static_cast<std::ptrdiff_t>(capacity_ * sizeof(T)));
  }

  /// `values` must stay as they are until the stream has passed the copy, unless they are pageable.
  void Upload(std::span<const T> values, cudaStream_t stream) {
    Reserve(values.size());
    if (values.empty()) return;
    CheckCuda(
        cudaMemcpyAsync(data_, values.data(), values.size_bytes(), cudaMemcpyHostToDevice, stream),
        "copying to the device");
  }

  T* Data() { return data_; }
  const T* Data() const { return data_; }
  std::size_t Capacity() const { return capacity_; }
  void Swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
  }

 private:
  void Free() {
    if (data_ == nullptr) return;
    cudaFree(data_);
    CountDeviceBytes(-static_cast<std::ptrdiff_t>(capacity_ * sizeof(T)));
    data_ = nullptr;
    capacity_ = 0;
  }

  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

/// Values of the host in pinned memory.
template <class T>
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  ~PinnedBuffer() { Free(); }
  PinnedBuffer(const PinnedBuffer&) = delete;
  PinnedBuffer& operator=(const PinnedBuffer&) = delete;

  /// Makes room; what was there is lost if the buffer has to grow.
  std::span<T> Resize(std::size_t size) {
    if (size > capacity_) {
      Free();
      capacity_ = size + size / 2;
      void* memory = nullptr;
      CheckCuda(cudaMallocHost(&memory, capacity_ * sizeof(T)), "allocating pinned memory");
      data_ = static_cast<T*>(memory);
    }
    return {data_, size};
  }
  std::span<const T> Fill(std::span<const T> values) {
    std::copy(values.begin(), values.end(), Resize(values.size()).begin());
    return {data_, values.size()};
  }
  T* Data() { return data_; }

 private:
  void Free() {
    if (data_ != nullptr) cudaFreeHost(data_);
    data_ = nullptr;
    capacity_ = 0;
  }

  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

/// The order of work on the device.
class Stream {
 public:
  Stream() { CheckCuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "a stream"); }
  ~Stream() { cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  operator cudaStream_t() const { return stream_; }  // NOLINT(google-explicit-constructor)
  void Wait() const { CheckCuda(cudaStreamSynchronize(stream_), "a kernel or a copy"); }

 private:
  cudaStream_t stream_ = nullptr;
};

/// A point in a stream that the host can wait for.
class Event {
 public:
  Event() { CheckCuda(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "an event"); }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void Record(cudaStream_t stream) { CheckCuda(cudaEventRecord(event_, stream), "an event"); }
  void Wait() const { CheckCuda(cudaEventSynchronize(event_), "a kernel or a copy"); }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace covsplat::cuda
