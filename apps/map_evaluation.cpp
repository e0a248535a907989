#include "apps/map_evaluation.hpp"

#include <chrono>

#include "apps/error_heatmap.hpp"
#include "apps/exit_code.hpp"
#include "apps/progress.hpp"
#include "apps/run_truth.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>

#include "covsplat/eval/surface.hpp"
#include "covsplat/io/scan_source.hpp"
#include "covsplat/io/trajectory_file.hpp"
#include "covsplat/mapping/map_file.hpp"

namespace covsplat {
namespace {

constexpr double kScanPeriodS = 0.1;  // of recordings without times

Result<std::optional<Trajectory>> LoadTruePoses(const MapEvaluationRequest& request) {
  if (!request.recording) return std::optional<Trajectory>();
  const auto truth = LoadTruth(*request.recording, request.true_poses, kScanPeriodS);
  if (!truth) return Forward(truth);
  if (!*truth) {
    return Fail(ErrorCode::kInput,
                "{}: holds no true poses, which tell what was visible; give them with --gt",
                request.recording->string());
  }
  return std::optional((*truth)->trajectory);
}

/// The rigid transform that brings the matched poses together: their positions, and with them the
/// points a lever away along each axis of the sensor, without which a short or straight path would
/// leave the map free to tilt.
SE3 AlignPoses(const Trajectory& estimate, const Trajectory& truth) {
  constexpr double kLeverM = 1.0;
  const double max_gap_s = TrajectoryErrorOptions().max_gap_s;
  std::vector<SE3> source, target;
  for (const TimedPose& pose : estimate) {
    const auto true_pose = PoseAt(truth, pose.stamp_s, max_gap_s);
    if (!true_pose || !pose.T_world_sensor.IsFinite()) continue;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double lever_m : {-kLeverM, kLeverM}) {
        const SE3 T_sensor_tip(Eigen::Quaterniond::Identity(),
                               lever_m * Eigen::Vector3d::Unit(axis));
        source.push_back(pose.T_world_sensor * T_sensor_tip);
        target.push_back(*true_pose * T_sensor_tip);
      }
    }
  }
  return AlignRigid(source, target);
}

/// Moves the result's frame to that of the truth.
Result<void> Align(const MapEvaluationRequest& request,
                   const std::optional<Trajectory>& truth,
                   MapEvaluation& evaluation) {
  if (request.T_truth_result) evaluation.T_truth_result = *request.T_truth_result;
  if (!request.trajectory) return {};
  if (!truth) {
    return Fail(ErrorCode::kUsage,
                "{} can only be aligned with true poses; name their recording with --recording",
                request.trajectory->string());
  }
  const auto estimate = LoadForRecording(*request.trajectory, *request.recording, kScanPeriodS);
  if (!estimate) return Forward(estimate);
  const TrajectoryError error = EvaluateTrajectory(*estimate, *truth);
  if (error.matched == 0) {
    return Fail(ErrorCode::kInput,
                "{}: no pose has a true one at its time in {}",
                request.trajectory->string(),
                request.recording->string());
  }
  evaluation.T_truth_result = AlignPoses(*estimate, *truth);
  evaluation.alignment = error;
  return {};
}

/// Damaged scans are passed over with a warning, as a run does.
Result<ObservedSpace> Observe(const MapEvaluationRequest& request,
                              const Trajectory& truth,
                              MapEvaluation& evaluation) {
  const auto source = OpenScanSource(*request.recording, {});
  if (!source) return Forward(source);
  ObservedSpace space(request.visibility);
  Progress::Options options;
  options.quiet = request.quiet;
  Progress progress(options);
  ProgressStatus status;
  status.total = (*source)->ScanCount();
  status.gaussians = -1;
  while (status.done < status.total) {
    const auto start = std::chrono::steady_clock::now();
    const auto scan = (*source)->Next();
    if (!scan) {
      progress.Message("covsplat: warning: " + scan.error().message);
    } else if (*scan) {
      evaluation.returns += space.Add(**scan, truth);
    }
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    ++status.done;
    status.ms_per_scan = took.count();
    status.rss_bytes = ReadMemoryUse().rss_bytes;
    progress.Update(status);
  }
  if (evaluation.returns == 0) {
    return Fail(ErrorCode::kInput,
                "{}: none of its points has a true pose at its time",
                request.recording->string());
  }
  return space;
}

/// Of a map in a format that is of maps only, the means of its Gaussians are the points.
Result<Surface> LoadResult(const std::filesystem::path& path) {
  const Result<MapFormat> format = MapFormatOf(path);
  if (!format || *format == MapFormat::kPly) return LoadSurface(path);
  const Result<MapFile> read = ReadMapFile(path);
  if (!read) return Forward(read);
  Surface surface;
  for (std::size_t i = 0; i < read->map.Size(); ++i) {
    surface.points.push_back(MeanOf(read->map.gaussians, i).cast<double>());
  }
  if (!surface.points.empty()) return surface;
  return Fail(ErrorCode::kInput, "{}: holds no Gaussians, so there is no surface", path.string());
}

JudgedSurface Judged(const std::filesystem::path& path,
                     const Surface& surface,
                     std::size_t points) {
  return {path, surface.mesh.triangles.size(), points};
}

void Warn(const Surface& result, const Surface& truth, const SE3& T_truth_result) {
  for (const std::string& remark : result.remarks) ReportWarning(remark);
  for (const std::string& remark : truth.remarks) ReportWarning(remark);
  const auto odd = OddBounds(BoundsOf(result, T_truth_result), BoundsOf(truth));
  if (odd) ReportWarning(*odd);
}

/// All figures of two surfaces whose frames are known, and the heat map.
Result<void> Measure(const MapEvaluationRequest& request,
                     const Surface& result,
                     const Surface& truth,
                     const std::optional<Trajectory>& true_poses,
                     MapEvaluation& evaluation) {
  ThreadPool pool(request.threads);
  SamplingOptions truth_sampling = request.sampling;
  ++truth_sampling.seed;  // other samples than the result's, even of the same surface
  const auto result_points = PointsOf(result, evaluation.T_truth_result, request.sampling, pool);
  if (!result_points) return Forward(result_points);
  const auto truth_points = PointsOf(truth, {}, truth_sampling, pool);
  if (!truth_points) return Forward(truth_points);
  evaluation.result = Judged(request.result, result, result_points->size());
  evaluation.truth = Judged(request.truth, truth, truth_points->size());

  const SurfaceDistances distances = MeasureDistances(*result_points, *truth_points, pool);
  evaluation.paper = PaperError(distances, request.errors);
  std::vector<std::uint8_t> visible;
  if (true_poses) {
    const auto space = Observe(request, *true_poses, evaluation);
    if (!space) return Forward(space);
    visible = space->Visible(*truth_points, pool);
    evaluation.strict = StrictError(
        distances, space->InObservedSpace(*result_points, pool), visible, request.errors);
  }
  if (!request.heatmap) return {};
  auto written = WriteHeatmap(
      {*request.heatmap, request.heat_limit_m},
      {result, evaluation.T_truth_result, *result_points, *truth_points, std::move(visible)},
      distances,
      pool);
  if (!written) return Forward(written);
  evaluation.written = std::move(*written);
  return {};
}

}  // namespace

Result<MapEvaluation> EvaluateMap(const MapEvaluationRequest& request) {
  if (request.heatmap) {
    const Result<void> writable = CheckHeatmapFolder(*request.heatmap);
    if (!writable) return Forward(writable);
  }
  const Result<Surface> result = LoadResult(request.result);
  if (!result) return Forward(result);
  const Result<Surface> truth = LoadSurface(request.truth);
  if (!truth) return Forward(truth);
  const Result<std::optional<Trajectory>> true_poses = LoadTruePoses(request);
  if (!true_poses) return Forward(true_poses);
  MapEvaluation evaluation;
  const Result<void> aligned = Align(request, *true_poses, evaluation);
  if (!aligned) return Forward(aligned);
  Warn(*result, *truth, evaluation.T_truth_result);
  const Result<void> measured = Measure(request, *result, *truth, *true_poses, evaluation);
  if (!measured) return Forward(measured);
  return evaluation;
}

}  // namespace covsplat
