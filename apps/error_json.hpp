// Errors of a trajectory as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "covsplat/eval/trajectory_error.hpp"

namespace covsplat {

nlohmann::ordered_json ErrorJson(const TrajectoryError& error);

}  // namespace covsplat
