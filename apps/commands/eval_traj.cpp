#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/error_json.hpp"
#include "apps/exit_code.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/eval/trajectory_units.hpp"
#include "covsplat/io/trajectory_file.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

struct EvalOptions {
  std::string estimate;
  std::string truth;
  std::string times;
  std::string align = "rigid";
  double time_offset_s = 0.0;
  TrajectoryErrorOptions error;
  bool json = false;
};

/// Without stamps, lines of KITTI files count as a tenth of a second each.
Result<std::vector<double>> StampsFor(const EvalOptions& options) {
  if (!options.times.empty()) return ReadStamps(options.times);
  const auto estimate = DetectTrajectoryFormat(options.estimate);
  if (!estimate) return Forward(estimate);
  const auto truth = DetectTrajectoryFormat(options.truth);
  if (!truth) return Forward(truth);
  const bool timeless = *estimate == TrajectoryFormat::kKitti;
  if (timeless != (*truth == TrajectoryFormat::kKitti)) {
    return Fail(ErrorCode::kUsage,
                "{} has no times; give the times of its lines with --times, as in the times.txt of "
                "a recording",
                timeless ? options.estimate : options.truth);
  }
  std::vector<double> stamps;
  if (!timeless) return stamps;
  const auto poses = ReadKittiPoses(options.estimate);
  if (!poses) return Forward(poses);
  for (std::size_t i = 0; i < poses->size(); ++i) stamps.push_back(0.1 * static_cast<double>(i));
  return stamps;
}

std::string Row(const std::string& name, const ErrorStatistics& s, const char* unit) {
  return fmt::format("{:24} {:>10.4f} {:>10.4f} {:>10.4f} {:>10.4f}  {}\n",
                     name,
                     s.rmse,
                     s.mean,
                     s.median,
                     s.max,
                     unit);
}

std::string DriftRow(const std::string& name, const Drift& drift) {
  if (drift.overall.segments == 0) return "";
  return fmt::format("{:24} {:.3f} % and {:.4f} deg/m over {} segments\n",
                     name,
                     drift.overall.translation_percent,
                     drift.overall.rotation_deg_per_m,
                     drift.overall.segments);
}

std::string DriftRows(const TrajectoryError& e) {
  if (e.kitti_drift.overall.segments == 0) {
    const std::string text = "the path is too short for KITTI's segments of 100 to 800 m\n";
    return text + DriftRow("drift, 10 to 50 m", e.short_drift);
  }
  const double longest_m = e.kitti_drift.by_length.back().length_m;
  std::string text = DriftRow(fmt::format("drift, 100 to {:.0f} m", longest_m), e.kitti_drift);
  if (longest_m < 800.0) text += "(the path is too short for longer segments, up to 800 m)\n";
  return text + DriftRow("drift, 10 to 50 m", e.short_drift);
}

std::string MatchText(const TrajectoryError& e) {
  std::string text = fmt::format("{} poses compared", e.matched);
  if (e.interpolated > 0) text += fmt::format(" ({} with interpolated truth)", e.interpolated);
  if (e.outside_truth > 0) text += fmt::format(", {} before or after the truth", e.outside_truth);
  const std::size_t in_gaps = e.without_truth - e.outside_truth;
  if (in_gaps > 0) text += fmt::format(", {} in gaps of the truth", in_gaps);
  if (e.not_finite > 0) text += fmt::format(", {} not finite", e.not_finite);
  return text + fmt::format("; {:.3f} to {:.3f} s; path {} (truth {})\n",
                            e.first_matched_s,
                            e.last_matched_s,
                            FormatMetres(e.estimate_length_m),
                            FormatMetres(e.truth_length_m));
}

std::string TableOf(const TrajectoryError& e, double rpe_distance_m) {
  std::string text = MatchText(e);
  text += fmt::format("\n{:24} {:>10} {:>10} {:>10} {:>10}\n", "", "rmse", "mean", "median", "max");
  text += Row("absolute position", e.ate_translation_m, "m");
  text += Row("absolute orientation", e.ate_rotation_deg, "deg");
  text += Row("relative, pose to pose", e.rpe_by_pose.translation_m, "m");
  text += Row("", e.rpe_by_pose.rotation_deg, "deg");
  if (e.rpe_by_distance.pairs > 0) {
    text += Row(
        fmt::format("relative, over {:g} m", rpe_distance_m), e.rpe_by_distance.translation_m, "m");
    text += Row("", e.rpe_by_distance.rotation_deg, "deg");
  }
  return text + DriftRows(e);
}

/// A trajectory that has poses.
Result<Trajectory> LoadSome(const std::string& path, const std::vector<double>& stamps) {
  Result<Trajectory> trajectory = LoadTrajectory(path, stamps);
  if (trajectory && trajectory->empty()) {
    return Fail(ErrorCode::kInput, "{}: holds no poses", path);
  }
  return trajectory;
}

ExitCode EvalTrajectory(const EvalOptions& options) {
  const auto stamps = StampsFor(options);
  if (!stamps) return ReportError(stamps.error());
  Result<Trajectory> estimate = LoadSome(options.estimate, *stamps);
  if (!estimate) return ReportError(estimate.error());
  const Result<Trajectory> truth = LoadSome(options.truth, *stamps);
  if (!truth) return ReportError(truth.error());
  for (TimedPose& pose : *estimate) pose.stamp_s += options.time_offset_s;
  TrajectoryErrorOptions evaluate = options.error;
  if (options.align == "first") evaluate.alignment = Alignment::kFirstPose;
  if (options.align == "none") evaluate.alignment = Alignment::kNone;
  const TrajectoryError error = EvaluateTrajectory(*estimate, *truth, evaluate);
  if (error.matched == 0) {
    return ReportError({ErrorCode::kInput,
                        fmt::format("{}: no pose has a truth in {} at its time: {}",
                                    options.estimate,
                                    options.truth,
                                    ExplainNoOverlap(*estimate, *truth))});
  }
  if (const auto odd = OddMatch(*estimate, *truth, error)) ReportWarning(*odd);
  fmt::print(
      "{}",
      options.json ? ErrorJson(error).dump(2) + "\n" : TableOf(error, evaluate.rpe_distance_m));
  return kExitOk;
}

}  // namespace

void AddEvalTrajectoryCommand(CLI::App& eval, int& exit_code) {
  const auto options = std::make_shared<EvalOptions>();
  CLI::App* traj = eval.add_subcommand(
      "traj", "Compare two trajectories (TUM, KITTI, EuRoC or Newer College files)");
  traj->add_option("estimate", options->estimate, "Trajectory to judge")->type_name("")->required();
  traj->add_option("truth", options->truth, "Trajectory to judge it by")->type_name("")->required();
  traj->add_option("--align", options->align, "How the estimate is moved to the truth first")
      ->check(CLI::IsMember({"rigid", "first", "none"}))
      ->capture_default_str();
  traj->add_option("--times", options->times, "Times of the lines of KITTI files")
      ->type_name("FILE");
  traj->add_option("--time-offset", options->time_offset_s, "Added to the times of the estimate")
      ->type_name("SECONDS");
  traj->add_option(
          "--max-gap", options->error.max_gap_s, "Truth is interpolated over this, seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  traj->add_option("--delta", options->error.rpe_distance_m, "Step of the relative error, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  traj->add_flag("--json", options->json, "Print JSON");
  traj->callback([options, &exit_code] { exit_code = EvalTrajectory(*options); });
}

}  // namespace covsplat
