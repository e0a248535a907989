// How far an estimated trajectory is from the truth: absolute error after alignment, relative error
// over short steps, and drift over longer segments as the KITTI odometry benchmark defines it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "covsplat/core/trajectory.hpp"

namespace covsplat {

/// How the estimate is moved into the truth's frame before absolute errors are taken. There is no
/// scale in any of them: a LiDAR knows its scale.
enum class Alignment {
  kRigid,      ///< least squares over all matched positions (Umeyama)
  kFirstPose,  ///< the first matched poses coincide
  kNone,       ///< both are in the same frame already
};

struct TrajectoryErrorOptions {
  Alignment alignment = Alignment::kRigid;
  double max_gap_s = 0.5;       ///< truth is interpolated between samples at most this far apart
  double rpe_distance_m = 1.0;  ///< step of the relative error by distance
  int segment_step = 10;        ///< a drift segment starts at every n-th matched pose
};

/// All zero if there was nothing to measure.
struct ErrorStatistics {
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
};

/// Errors of the motion over steps along the trajectory.
struct RelativeError {
  int pairs = 0;
  ErrorStatistics translation_m;
  ErrorStatistics rotation_deg;
};

/// Mean drift over all segments of one length, or over those of several lengths (length_m = 0).
struct SegmentDrift {
  double length_m = 0.0;
  int segments = 0;
  double translation_percent = 0.0;
  double rotation_deg_per_m = 0.0;
};

/// Drift over segments of several lengths; lengths that the path does not reach are left out.
struct Drift {
  SegmentDrift overall;  ///< mean over the segments of all lengths
  std::vector<SegmentDrift> by_length;
};

/// Poses of the estimate that have a truth, and everything measured on them.
struct TrajectoryError {
  std::size_t matched = 0;
  std::size_t interpolated = 0;   ///< of the matched ones: between two samples of the truth
  std::size_t without_truth = 0;  ///< finite poses of the estimate at times without truth
  std::size_t outside_truth = 0;  ///< of these: before the truth begins or after it ends
  std::size_t not_finite = 0;     ///< poses of the estimate with NaN or infinity; ignored
  SE3 T_truth_estimate;           ///< the alignment, from the estimate's frame to the truth's

  ErrorStatistics ate_translation_m;
  ErrorStatistics ate_rotation_deg;
  RelativeError rpe_by_pose;      ///< from each matched pose to the next
  RelativeError rpe_by_distance;  ///< over consecutive steps of `rpe_distance_m` along the truth
  Drift kitti_drift;              ///< segments of 100, 200, ..., 800 m
  Drift short_drift;              ///< segments of 10, 20 and 50 m: not comparable with KITTI's

  double first_matched_s = 0.0;    ///< time of the first matched pose
  double last_matched_s = 0.0;     ///< and of the last
  double estimate_length_m = 0.0;  ///< path length over the matched poses
  double truth_length_m = 0.0;     ///< path length over the same poses
};

/// Compares by time: each pose of the estimate meets the truth interpolated at its stamp. Poses may
/// be in any frames; both trajectories must track the same point of the sensor.
TrajectoryError EvaluateTrajectory(const Trajectory& estimate,
                                   const Trajectory& truth,
                                   const TrajectoryErrorOptions& options = {});

/// The rigid transform T_target_source that brings `source` closest to `target` in the sense of
/// least squares of positions. Orientations decide only what the positions leave open: the rotation
/// about a straight path, or all of it at a single position. Spans have the same, non-zero size.
SE3 AlignRigid(std::span<const SE3> source, std::span<const SE3> target);

/// Sum of the distances between consecutive positions, in metres.
double PathLength(std::span<const SE3> poses);

}  // namespace covsplat
