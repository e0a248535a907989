// What this machine can do at most: the ceilings that kernels are held against.
#pragma once

#include "covsplat/core/parallel.hpp"

namespace covsplat {

struct MachinePeak {
  double flops_per_s = 0.0;  ///< of float, a multiply-add being two, in the widest vectors
  double bytes_per_s = 0.0;  ///< of memory, read and written in equal parts
};

/// Measures both, with all threads of the pool; a quarter of a second.
MachinePeak MeasurePeak(ThreadPool& pool);

/// Seconds that so much work takes at least.
inline double RooflineSeconds(const MachinePeak& peak, double flops, double bytes) {
  const double computing = flops / peak.flops_per_s;
  const double moving = bytes / peak.bytes_per_s;
  return computing > moving ? computing : moving;
}

}  // namespace covsplat
