// `covsplat eval map`: a surface against the true one, from files to figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "covsplat/core/result.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/eval/observed_space.hpp"
#include "covsplat/eval/surface_error.hpp"
#include "covsplat/eval/surface_samples.hpp"
#include "covsplat/eval/trajectory_error.hpp"

namespace covsplat {

struct MapEvaluationRequest {
  std::filesystem::path result;
  std::filesystem::path truth;
  std::optional<std::filesystem::path> recording;   ///< whose true poses tell what was visible
  std::optional<std::filesystem::path> true_poses;  ///< in place of those found there
  std::optional<std::filesystem::path> trajectory;  ///< that the result was made with
  std::optional<SE3> T_truth_result;                ///< in place of the trajectory
  SurfaceErrorOptions errors;
  SamplingOptions sampling;
  ObservedSpaceOptions visibility;
  std::optional<std::filesystem::path> heatmap;
  double heat_limit_m = 0.1;
  int threads = 0;
  bool quiet = false;
};

/// A surface as it was judged.
struct JudgedSurface {
  std::filesystem::path path;
  std::size_t triangles = 0;  ///< 0: a cloud
  std::size_t points = 0;
};

struct MapEvaluation {
  JudgedSurface result;
  JudgedSurface truth;
  SE3 T_truth_result;
  std::optional<TrajectoryError> alignment;  ///< of the trajectories, if that moved the result
  std::size_t returns = 0;                   ///< of the recording that had a true pose
  SurfaceError paper;
  std::optional<SurfaceError> strict;  ///< with a recording only
  std::vector<std::filesystem::path> written;
};

/// Warnings go to stderr, and so does the progress of reading the recording.
Result<MapEvaluation> EvaluateMap(const MapEvaluationRequest& request);

nlohmann::ordered_json MapEvaluationJson(const MapEvaluationRequest& request,
                                         const MapEvaluation& evaluation);

/// A table for people.
std::string MapEvaluationText(const MapEvaluation& evaluation);

}  // namespace covsplat
