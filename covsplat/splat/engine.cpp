#include "covsplat/splat/engine.hpp"

#include "covsplat/splat/cpu/cpu_engine.hpp"
#include "covsplat/splat/cuda/make_engine.hpp"

namespace covsplat {

Result<std::unique_ptr<SplatEngine>> MakeSplatEngine(Backend backend,
                                                     const SensorModel& sensor,
                                                     const EngineConfig& config,
                                                     ThreadPool& pool) {
  std::string device = "cpu";
  if (backend == Backend::kCuda || (backend == Backend::kAuto && cuda::IsBuilt())) {
    Result<std::unique_ptr<SplatEngine>> engine = cuda::MakeEngine(sensor, config);
    if (engine || backend == Backend::kCuda) return engine;
    device = fmt::format("cpu ({})", engine.error().message);
  }
  return std::make_unique<CpuEngine>(sensor, config, std::move(device), pool);
}

}  // namespace covsplat
