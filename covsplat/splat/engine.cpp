#include "covsplat/splat/engine.hpp"

#include "covsplat/splat/cpu/cpu_engine.hpp"

namespace covsplat {

Result<std::unique_ptr<SplatEngine>> MakeSplatEngine(Backend backend,
                                                     const SensorModel& sensor,
                                                     const EngineConfig& config,
                                                     ThreadPool& pool) {
  if (backend == Backend::kCuda) {
    return Fail(ErrorCode::kUnavailable,
                "this build has no CUDA backend; use --backend cpu (or auto)");
  }
  return std::make_unique<CpuEngine>(sensor, config, pool);
}

}  // namespace covsplat
