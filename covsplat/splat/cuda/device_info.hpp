// The CUDA device of this machine, in plain C++: for messages, tests and benchmarks.
#pragma once

#include <cstddef>
#include <string>

#include "covsplat/core/result.hpp"

namespace covsplat::cuda {

struct DeviceInfo {
  std::string name;
  std::string capability;  ///< for example "9.0"
  int multiprocessors = 0;
  double memory_bytes = 0.0;
};

/// The device that engines run on. kUnavailable, with the reason, if this build or machine has none
/// or this build has no code for it.
Result<DeviceInfo> FindDevice();

/// Device memory that engines of this process hold now.
std::size_t DeviceBytes();

/// Bytes read and written per second by a large copy within the device.
double MeasureCopyBandwidth();

}  // namespace covsplat::cuda
