// Work in the background: it takes the processor time that nobody else wants.
#pragma once

#include <memory>

#include "covsplat/core/parallel.hpp"

namespace covsplat {

/// From now on the calling thread, and threads that it starts, give way to the others: where there
/// are more threads than processors, it gets little until the others wait for something. Where the
/// system knows no such thing, nothing changes.
void GoToBackground();

/// A pool whose workers are in the background, whoever calls it.
std::unique_ptr<ThreadPool> MakeBackgroundPool(int threads);

}  // namespace covsplat
