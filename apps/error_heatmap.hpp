// Where a surface is wrong: the surface itself with colours, and pictures from above.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/eval/surface.hpp"
#include "covsplat/eval/surface_error.hpp"

namespace covsplat {

struct HeatmapOptions {
  std::filesystem::path file;  ///< .ply; pictures take its name
  double limit_m = 0.1;        ///< that is drawn in full red
};

/// What was compared, in the frame of the truth but for `result`.
struct ComparedSurfaces {
  const Surface& result;
  const SE3& T_truth_result;
  const std::vector<Eigen::Vector3d>& result_points;
  const std::vector<Eigen::Vector3d>& truth_points;
  std::vector<std::uint8_t> judged_truth;  ///< one per point, or empty: all of them
};

/// Says early if there is no folder to write a heat map to.
Result<void> CheckHeatmapFolder(const std::filesystem::path& file);

/// Writes NAME.ply (the result's mesh or points in the truth's frame, with the scalar error_m and a
/// colour each), NAME_accuracy.png (errors of the result) and NAME_completeness.png (errors of the
/// truth that is judged); returns these paths.
Result<std::vector<std::filesystem::path>> WriteHeatmap(const HeatmapOptions& options,
                                                        const ComparedSurfaces& surfaces,
                                                        const SurfaceDistances& distances,
                                                        ThreadPool& pool);

}  // namespace covsplat
