#include "covsplat/eval/trajectory_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/SVD>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::array kKittiLengthsM = {100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0};
constexpr std::array kShortLengthsM = {10.0, 20.0, 50.0};

struct Matches {
  std::vector<SE3> estimate;
  std::vector<SE3> truth;        // same size
  std::vector<double> stamps_s;  // same size
  std::size_t interpolated = 0;
  std::size_t without_truth = 0;
  std::size_t outside_truth = 0;
  std::size_t not_finite = 0;
};

struct PoseError {
  double translation_m = 0.0;
  double rotation_deg = 0.0;
};

// Indices of two matched poses.
struct Step {
  std::size_t from = 0;
  std::size_t to = 0;
};

PoseError ErrorOf(const SE3& difference) {
  return {difference.Translation().norm(),
          difference.Log().head<3>().norm() * 180.0 / std::numbers::pi};
}

PoseError StepError(const Matches& matches, const Step& step) {
  const SE3 estimate = matches.estimate[step.from].Inverse() * matches.estimate[step.to];
  const SE3 truth = matches.truth[step.from].Inverse() * matches.truth[step.to];
  return ErrorOf(truth.Inverse() * estimate);
}

ErrorStatistics StatisticsOf(std::vector<double> values) {
  if (values.empty()) return {};
  ErrorStatistics result;
  std::sort(values.begin(), values.end());
  for (const double value : values) {
    result.mean += value;
    result.rmse += value * value;
  }
  const std::size_t n = values.size();
  result.mean /= static_cast<double>(n);
  result.rmse = std::sqrt(result.rmse / static_cast<double>(n));
  result.median = 0.5 * (values[(n - 1) / 2] + values[n / 2]);
  result.max = values.back();
  return result;
}

std::vector<double> Translations(const std::vector<PoseError>& errors) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const PoseError& error : errors) values.push_back(error.translation_m);
  return values;
}

std::vector<double> Rotations(const std::vector<PoseError>& errors) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const PoseError& error : errors) values.push_back(error.rotation_deg);
  return values;
}

SE3 AlignmentOf(const Matches& matches, Alignment alignment) {
  if (alignment == Alignment::kNone || matches.truth.empty()) return {};
  if (alignment == Alignment::kFirstPose) {
    return matches.truth.front() * matches.estimate.front().Inverse();
  }
  return AlignRigid(matches.estimate, matches.truth);
}

// Path length up to each pose.
std::vector<double> Distances(std::span<const SE3> poses) {
  std::vector<double> distance(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    distance[i] = distance[i - 1] + (poses[i].Translation() - poses[i - 1].Translation()).norm();
  }
  return distance;
}

std::vector<Step> StepsByPose(std::size_t poses) {
  std::vector<Step> steps;
  for (std::size_t i = 1; i < poses; ++i) steps.push_back({i - 1, i});
  return steps;
}

// Consecutive steps, each ending at the first pose at least `distance_m` from its beginning; the
// tolerance is for sums that should have met the distance exactly.
std::vector<Step> StepsByDistance(const std::vector<double>& distance, double distance_m) {
  std::vector<Step> steps;
  std::size_t from = 0;
  for (std::size_t i = 1; i < distance.size(); ++i) {
    if (distance[i] - distance[from] < distance_m - 1e-9) continue;
    steps.push_back({from, i});
    from = i;
  }
  return steps;
}

RelativeError RelativeErrorOf(const Matches& matches, const std::vector<Step>& steps) {
  std::vector<PoseError> errors;
  errors.reserve(steps.size());
  for (const Step& step : steps) errors.push_back(StepError(matches, step));
  return {static_cast<int>(steps.size()),
          StatisticsOf(Translations(errors)),
          StatisticsOf(Rotations(errors))};
}

// Segments as in KITTI's evaluation: the end is the first pose farther than the length, and errors
// are divided by the nominal length.
SegmentDrift DriftOver(const Matches& matches,
                       const std::vector<double>& distance,
                       double length_m,
                       int segment_step) {
  SegmentDrift drift{length_m, 0, 0.0, 0.0};
  const auto increment = static_cast<std::size_t>(segment_step);
  for (std::size_t from = 0; from < distance.size(); from += increment) {
    const auto to = std::upper_bound(distance.begin(), distance.end(), distance[from] + length_m);
    if (to == distance.end()) break;
    const PoseError error =
        StepError(matches, {from, static_cast<std::size_t>(to - distance.begin())});
    ++drift.segments;
    drift.translation_percent += 100.0 * error.translation_m / length_m;
    drift.rotation_deg_per_m += error.rotation_deg / length_m;
  }
  if (drift.segments > 0) {
    drift.translation_percent /= drift.segments;
    drift.rotation_deg_per_m /= drift.segments;
  }
  return drift;
}

Drift DriftOf(const Matches& matches,
              const std::vector<double>& distance,
              std::span<const double> lengths_m,
              int segment_step) {
  Drift drift;
  for (const double length_m : lengths_m) {
    const SegmentDrift one = DriftOver(matches, distance, length_m, segment_step);
    if (one.segments == 0) continue;
    drift.by_length.push_back(one);
    drift.overall.segments += one.segments;
    drift.overall.translation_percent += one.segments * one.translation_percent;
    drift.overall.rotation_deg_per_m += one.segments * one.rotation_deg_per_m;
  }
  if (drift.overall.segments > 0) {
    drift.overall.translation_percent /= drift.overall.segments;
    drift.overall.rotation_deg_per_m /= drift.overall.segments;
  }
  return drift;
}

bool HasSampleAt(const Trajectory& trajectory, double stamp_s) {
  const auto earlier = [](const TimedPose& pose, double stamp) { return pose.stamp_s < stamp; };
  const auto at = std::lower_bound(trajectory.begin(), trajectory.end(), stamp_s, earlier);
  return at != trajectory.end() && at->stamp_s == stamp_s;
}

Matches Associate(const Trajectory& estimate, const Trajectory& truth, double max_gap_s) {
  Matches matches;
  for (const TimedPose& pose : estimate) {
    if (!pose.T_world_sensor.IsFinite()) {
      ++matches.not_finite;
    } else if (const auto at = PoseAt(truth, pose.stamp_s, max_gap_s)) {
      matches.estimate.push_back(pose.T_world_sensor);
      matches.truth.push_back(*at);
      matches.stamps_s.push_back(pose.stamp_s);
      matches.interpolated += !HasSampleAt(truth, pose.stamp_s);
    } else {
      ++matches.without_truth;
      matches.outside_truth += truth.empty() || pose.stamp_s < truth.front().stamp_s ||
                               pose.stamp_s > truth.back().stamp_s;
    }
  }
  return matches;
}

Eigen::Vector3d MeanPosition(std::span<const SE3> poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SE3& pose : poses) sum += pose.Translation();
  return sum / static_cast<double>(poses.size());
}

// The rotation R that maximises trace(R^T * matrix).
Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) *= -1.0;
  return u * svd.matrixV().transpose();
}

}  // namespace

double PathLength(std::span<const SE3> poses) {
  return poses.empty() ? 0.0 : Distances(poses).back();
}

SE3 AlignRigid(std::span<const SE3> source, std::span<const SE3> target) {
  COVSPLAT_CHECK(!source.empty() && source.size() == target.size());
  const Eigen::Vector3d source_mean = MeanPosition(source);
  const Eigen::Vector3d target_mean = MeanPosition(target);
  Eigen::Matrix3d positions = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d orientations = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    positions += (target[i].Translation() - target_mean) *
                 (source[i].Translation() - source_mean).transpose();
    orientations += target[i].RotationMatrix() * source[i].RotationMatrix().transpose();
  }
  const auto n = static_cast<double>(source.size());
  const Eigen::Vector3d spread = Eigen::JacobiSVD<Eigen::Matrix3d>(positions).singularValues();
  const double rounding = 1e-24 * n * (1.0 + target_mean.squaredNorm());
  if (spread(0) <= rounding) {  // all at one place
    positions = orientations;
  } else if (spread(1) < 1e-10 * spread(0)) {  // on a line, which the small weight hardly turns
    positions += 1e-8 * spread(0) / n * orientations;
  }
  const Eigen::Quaterniond rotation(NearestRotation(positions));
  return {rotation, target_mean - rotation * source_mean};
}

TrajectoryError EvaluateTrajectory(const Trajectory& estimate,
                                   const Trajectory& truth,
                                   const TrajectoryErrorOptions& options) {
  COVSPLAT_CHECK(options.segment_step > 0);
  const Matches matches = Associate(estimate, truth, options.max_gap_s);
  TrajectoryError result;
  result.matched = matches.truth.size();
  result.interpolated = matches.interpolated;
  result.without_truth = matches.without_truth;
  result.outside_truth = matches.outside_truth;
  if (result.matched > 0) {
    result.first_matched_s = matches.stamps_s.front();
    result.last_matched_s = matches.stamps_s.back();
  }
  result.not_finite = matches.not_finite;
  result.T_truth_estimate = AlignmentOf(matches, options.alignment);

  std::vector<PoseError> absolute;
  for (std::size_t i = 0; i < matches.truth.size(); ++i) {
    const SE3 aligned = result.T_truth_estimate * matches.estimate[i];
    absolute.push_back({(aligned.Translation() - matches.truth[i].Translation()).norm(),
                        ErrorOf(matches.truth[i].Inverse() * aligned).rotation_deg});
  }
  result.ate_translation_m = StatisticsOf(Translations(absolute));
  result.ate_rotation_deg = StatisticsOf(Rotations(absolute));

  const std::vector<double> distance = Distances(matches.truth);
  result.rpe_by_pose = RelativeErrorOf(matches, StepsByPose(matches.truth.size()));
  result.rpe_by_distance =
      RelativeErrorOf(matches, StepsByDistance(distance, options.rpe_distance_m));
  result.kitti_drift = DriftOf(matches, distance, kKittiLengthsM, options.segment_step);
  result.short_drift = DriftOf(matches, distance, kShortLengthsM, options.segment_step);
  result.estimate_length_m = PathLength(matches.estimate);
  result.truth_length_m = PathLength(matches.truth);
  return result;
}

}  // namespace covsplat
