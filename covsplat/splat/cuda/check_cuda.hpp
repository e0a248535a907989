// What happens when CUDA fails.
#pragma once

#include <cuda_runtime_api.h>

namespace covsplat::cuda {

/// A device that fails in the middle of a run leaves nothing to go on with: prints what failed and
/// why, and aborts. Devices that are missing from the start are found by FindDevice.
void CheckCuda(cudaError_t status, const char* what);

}  // namespace covsplat::cuda
