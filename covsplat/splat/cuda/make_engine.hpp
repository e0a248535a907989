// The way in to the CUDA backend, with or without CUDA in the build.
#pragma once

#include <memory>

#include "covsplat/splat/engine.hpp"

namespace covsplat::cuda {

/// Whether this build has the CUDA backend.
bool IsBuilt();

/// kUnavailable, with the reason, if this build or machine cannot run it.
Result<std::unique_ptr<SplatEngine>> MakeEngine(const SensorModel& sensor,
                                                const EngineConfig& config);

}  // namespace covsplat::cuda
