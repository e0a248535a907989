// Stands in for the CUDA backend in builds without it.
#include "covsplat/splat/cuda/device_info.hpp"
#include "covsplat/splat/cuda/make_engine.hpp"

namespace covsplat::cuda {
namespace {

tl::unexpected<Error> NotBuilt() {
  return Fail(
      ErrorCode::kUnavailable,
      "this build has no CUDA backend; use --backend cpu (or auto), or build with make cuda");
}

}  // namespace

bool IsBuilt() { return false; }

Result<std::string> FindDevice() { return NotBuilt(); }

std::size_t DeviceBytes() { return 0; }

double MeasureCopyBandwidth() { return 0.0; }

Result<std::unique_ptr<SplatEngine>> MakeEngine(const SensorModel&, const EngineConfig&) {
  return NotBuilt();
}

}  // namespace covsplat::cuda
