// Pose graphs as .g2o files, which the solvers of the field read and write.
#pragma once

#include <filesystem>

#include "covsplat/core/result.hpp"
#include "covsplat/loops/pose_graph.hpp"

namespace covsplat {

/// VERTEX_SE3:QUAT, EDGE_SE3:QUAT, EDGE_SE3_PRIOR and FIX, numbers to the last digit. Information
/// is of [translation, rotation] with rotations in radians, as GTSAM's and Ceres' readers take it.
Result<void> WriteG2o(const std::filesystem::path& path, const PoseGraph& graph);

/// The same; other lines of parameters are passed over. Nodes are numbered in the order of their
/// ids. Edges between neighbours in that order count as odometry, all others as doubtful. The error
/// names the line.
Result<PoseGraph> ReadG2o(const std::filesystem::path& path);

}  // namespace covsplat
