// The CUDA device of this machine, in plain C++: for messages, tests and benchmarks.
#pragma once

#include <cstddef>
#include <string>

#include "covsplat/core/result.hpp"

namespace covsplat::cuda {

/// Name of the device that engines run on. kUnavailable, with the reason, if this build or machine
/// has none or this build has no code for it.
Result<std::string> FindDevice();

/// Device memory that engines of this process hold now.
std::size_t DeviceBytes();

/// Bytes read and written per second by a large copy within the device.
double MeasureCopyBandwidth();

}  // namespace covsplat::cuda
