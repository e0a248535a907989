#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/error_json.hpp"
#include "apps/exit_code.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

struct EvalOptions {
  std::string estimate;
  std::string truth;
  std::string times;
  std::string align = "rigid";
  bool json = false;
};

bool IsKitti(const std::string& path) {
  constexpr std::size_t kKittiColumns = 12;
  const Result<std::string> text = ReadFile(path);
  if (!text) return false;
  LineReader lines(*text);
  return lines.NextWithContent() && SplitWords(lines.Line()).size() == kKittiColumns;
}

/// Without stamps, lines of KITTI files count as a tenth of a second each.
Result<std::vector<double>> StampsFor(const EvalOptions& options) {
  if (!options.times.empty()) return ReadStamps(options.times);
  const bool estimate = IsKitti(options.estimate);
  if (estimate != IsKitti(options.truth)) {
    return Fail(ErrorCode::kUsage,
                "{} has no times; give the times of its lines with --times, as in the times.txt of "
                "a recording",
                estimate ? options.estimate : options.truth);
  }
  std::vector<double> stamps;
  if (!estimate) return stamps;
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

std::string TableOf(const TrajectoryError& e) {
  std::string text = fmt::format("{} poses compared", e.matched);
  if (e.without_truth > 0) text += fmt::format(", {} without truth", e.without_truth);
  if (e.not_finite > 0) text += fmt::format(", {} not finite", e.not_finite);
  text += fmt::format("; path {} (truth {})\n\n",
                      FormatMetres(e.estimate_length_m),
                      FormatMetres(e.truth_length_m));
  text += fmt::format("{:24} {:>10} {:>10} {:>10} {:>10}\n", "", "rmse", "mean", "median", "max");
  text += Row("absolute position", e.ate_translation_m, "m");
  text += Row("absolute orientation", e.ate_rotation_deg, "deg");
  text += Row("relative, pose to pose", e.rpe_by_pose.translation_m, "m");
  text += Row("", e.rpe_by_pose.rotation_deg, "deg");
  if (e.rpe_by_distance.pairs > 0) {
    text += Row("relative, over 1 m", e.rpe_by_distance.translation_m, "m");
    text += Row("", e.rpe_by_distance.rotation_deg, "deg");
  }
  text += DriftRow("drift, 100 to 800 m", e.kitti_drift);
  text += DriftRow("drift, 10 to 50 m", e.short_drift);
  return text;
}

ExitCode EvalTrajectory(const EvalOptions& options) {
  const auto stamps = StampsFor(options);
  if (!stamps) return ReportError(stamps.error());
  const Result<Trajectory> estimate = LoadTrajectory(options.estimate, *stamps);
  if (!estimate) return ReportError(estimate.error());
  const Result<Trajectory> truth = LoadTrajectory(options.truth, *stamps);
  if (!truth) return ReportError(truth.error());
  TrajectoryErrorOptions evaluate;
  if (options.align == "first") evaluate.alignment = Alignment::kFirstPose;
  if (options.align == "none") evaluate.alignment = Alignment::kNone;
  const TrajectoryError error = EvaluateTrajectory(*estimate, *truth, evaluate);
  if (error.matched == 0) {
    return ReportError({ErrorCode::kInput,
                        fmt::format("{}: no pose has a truth in {} at its time; are both in the "
                                    "same clock?",
                                    options.estimate,
                                    options.truth)});
  }
  fmt::print("{}", options.json ? ErrorJson(error).dump(2) + "\n" : TableOf(error));
  return kExitOk;
}

}  // namespace

void AddEvalTrajectoryCommand(CLI::App& eval, int& exit_code) {
  const auto options = std::make_shared<EvalOptions>();
  CLI::App* traj = eval.add_subcommand("traj", "Compare two trajectories (TUM or KITTI files)");
  traj->add_option("estimate", options->estimate, "Trajectory to judge")->type_name("")->required();
  traj->add_option("truth", options->truth, "Trajectory to judge it by")->type_name("")->required();
  traj->add_option("--align", options->align, "How the estimate is moved to the truth first")
      ->check(CLI::IsMember({"rigid", "first", "none"}))
      ->capture_default_str();
  traj->add_option("--times", options->times, "Times of the lines of KITTI files")
      ->type_name("FILE");
  traj->add_flag("--json", options->json, "Print JSON");
  traj->callback([options, &exit_code] { exit_code = EvalTrajectory(*options); });
}

}  // namespace covsplat
