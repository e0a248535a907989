// Guesses the sensor model from the first scans of a recording.
#pragma once

#include <span>
#include <string>

#include "covsplat/core/scan.hpp"
#include "covsplat/core/sensor_model.hpp"

namespace covsplat {

struct SensorEstimateOptions {
  int columns = 1024;  ///< at most, for the full turn
};

/// How the rows of an estimated model were found.
enum class RowBasis {
  kBeams,    ///< the beams' elevations were measured
  kUniform,  ///< no beams to be seen: even rows that suit the density of the points
  kAssumed,  ///< no usable points: the model is a common sensor, not this one
};

struct SensorEstimate {
  SensorModel model;
  RowBasis basis = RowBasis::kAssumed;
  std::string verdict;  ///< what was found and how, for people
};

/// Uses all scans given; a handful, spread over the recording's start, is enough. Points that are
/// not finite or at the origin do not count. Range limits are wider than what was seen by a
/// quarter.
SensorEstimate EstimateSensorModel(std::span<const Scan> scans,
                                   const SensorEstimateOptions& options);

}  // namespace covsplat
