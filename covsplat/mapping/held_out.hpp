// How well a map shows what a scan measured that it was not trained on.
#pragma once

#include <cstddef>
#include <memory>

#include "covsplat/mapping/gaussian_map.hpp"

namespace covsplat {

/// Errors over the pixels that were measured and are rendered.
struct HeldOutErrors {
  std::size_t pixels = 0;
  double mean_abs_m = 0.0;    ///< 0 if there are no such pixels
  double median_abs_m = 0.0;  ///< as above
  double p90_abs_m = 0.0;     ///< nine of ten pixels are at least this good
  double p95_abs_m = 0.0;     ///< and 19 of 20
  double coverage = 0.0;      ///< share of the measured pixels that are rendered
};

/// Both images are ranges on the same grid, 0 where there is nothing.
HeldOutErrors MeasureHeldOut(const Image<float>& measured_m, const Image<float>& rendered_m);

/// A second engine with the keyframes of a map, and `gaussians` (a table with the rows of the
/// map's) in place of its own; training views and the optimiser's state are not copied.
Result<std::unique_ptr<SplatEngine>> CopyEngine(const GaussianMap& map,
                                                const GaussianColumns<float>& gaussians,
                                                Backend backend,
                                                const SensorModel& sensor,
                                                const EngineConfig& config,
                                                ThreadPool& pool);

}  // namespace covsplat
