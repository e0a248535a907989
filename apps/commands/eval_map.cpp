#include <algorithm>
#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/map_evaluation.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

struct EvalMapOptions {
  MapEvaluationRequest request;
  std::string result, truth, recording, true_poses, run, trajectory, transform, heatmap;
  bool json = false;
};

std::optional<std::filesystem::path> PathIfGiven(const std::string& text) {
  if (text.empty()) return std::nullopt;
  return std::filesystem::path(text);
}

/// 16 or 12 numbers, row by row, from the text itself or from the file that it names.
Result<SE3> ParseTransform(const std::string& text) {
  const auto given = ParseDoubles(text);
  std::vector<double> numbers = given.value_or(std::vector<double>());
  if (!given) {
    const Result<std::string> file = ReadFile(text);
    if (!file) return Forward(file);
    LineReader lines(*file);
    while (lines.NextWithContent()) {
      const auto row = ParseDoubles(lines.Line());
      if (!row) {
        return Fail(
            ErrorCode::kInput, "{}:{}: holds something that is not a number", text, lines.Number());
      }
      numbers.insert(numbers.end(), row->begin(), row->end());
    }
  }
  constexpr double kLastRow[] = {0.0, 0.0, 0.0, 1.0};
  if (numbers.size() == 16 && std::equal(numbers.begin() + 12, numbers.end(), kLastRow)) {
    numbers.resize(12);
  }
  const auto pose = PoseOfMatrix(numbers);
  if (pose) return *pose;
  return Fail(ErrorCode::kInput,
              "--transform {}: needs the 12 or 16 numbers of a rotation and a translation, row by "
              "row; there is no scale",
              text);
}

Result<MapEvaluationRequest> RequestOf(const EvalMapOptions& options) {
  MapEvaluationRequest request = options.request;
  request.result = options.result;
  request.truth = options.truth;
  request.recording = PathIfGiven(options.recording);
  request.true_poses = PathIfGiven(options.true_poses);
  request.heatmap = PathIfGiven(options.heatmap);
  request.trajectory = PathIfGiven(options.trajectory);
  if (!options.run.empty()) {
    request.trajectory = std::filesystem::path(options.run) / "trajectory_tum.txt";
  }
  if (request.true_poses && !request.recording) {
    return Fail(ErrorCode::kUsage, "--gt belongs to a recording; name it with --recording");
  }
  if (request.heatmap && request.heatmap->extension() != ".ply") {
    return Fail(ErrorCode::kUsage, "--heatmap {}: has to end in .ply", options.heatmap);
  }
  if (!options.transform.empty()) {
    const Result<SE3> transform = ParseTransform(options.transform);
    if (!transform) return Forward(transform);
    request.T_truth_result = *transform;
  }
  return request;
}

ExitCode EvalMap(const EvalMapOptions& options) {
  const Result<MapEvaluationRequest> request = RequestOf(options);
  if (!request) return ReportError(request.error());
  const Result<MapEvaluation> evaluation = EvaluateMap(*request);
  if (!evaluation) return ReportError(evaluation.error());
  if (options.json) {
    fmt::print("{}\n",
               MapEvaluationJson(*request, *evaluation)
                   .dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    fmt::print("{}", MapEvaluationText(*evaluation));
  }
  return kExitOk;
}

void AddFrameOptions(CLI::App& map, EvalMapOptions& options) {
  map.add_option("--recording",
                 options.recording,
                 "Recording whose true poses tell what was visible: adds the strict protocol")
      ->type_name("DIR");
  map.add_option("--gt", options.true_poses, "True poses in place of those in the recording")
      ->type_name("FILE");
  CLI::Option* run = map.add_option(
      "--run",
      options.run,
      "Run that the result comes from: moved to the truth by aligning its trajectory");
  CLI::Option* trajectory = map.add_option(
      "--trajectory", options.trajectory, "The same with a trajectory file of any program");
  CLI::Option* transform =
      map.add_option("--transform",
                     options.transform,
                     "T_truth_result: 16 numbers in quotes, row by row, or a file with them");
  run->type_name("DIR")->excludes(trajectory)->excludes(transform);
  trajectory->type_name("FILE")->excludes(transform);
  transform->type_name("MATRIX");
}

void AddMeasureOptions(CLI::App& map, MapEvaluationRequest& request) {
  map.add_option("--tau", request.errors.tau_m, "What counts as right; several at once")
      ->delimiter(',')
      ->type_name("METRES")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  map.add_option("--voxel", request.sampling.voxel_m, "Both surfaces: one point per voxel")
      ->type_name("METRES")
      ->check(CLI::Range(1e-4, 10.0))
      ->capture_default_str();
  map.add_option("--truncation", request.errors.truncation_m, "No error counts for more")
      ->type_name("METRES")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  map.add_option("--crop", request.errors.crop_m, "Paper: truth this far from the result is cut")
      ->type_name("METRES")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  map.add_option(
         "--visible", request.visibility.near_m, "Strict: truth this near to a return was visible")
      ->type_name("METRES")
      ->check(CLI::Range(1e-3, 10.0))
      ->capture_default_str();
  map.add_option("--seed", request.sampling.seed, "Of the samples on meshes")
      ->capture_default_str();
}

}  // namespace

void AddEvalMapCommand(CLI::App& eval, int& exit_code) {
  const auto options = std::make_shared<EvalMapOptions>();
  CLI::App* map = eval.add_subcommand(
      "map", "Compare a mesh or a cloud with the true surface (PLY, PCD); see docs/metrics.md");
  map->add_option("result", options->result, "Surface to judge")->type_name("")->required();
  map->add_option("truth", options->truth, "Surface to judge it by")->type_name("")->required();
  AddFrameOptions(*map, *options);
  AddMeasureOptions(*map, options->request);
  map->add_option("--heatmap",
                  options->heatmap,
                  "Write the result coloured by its error, and pictures with the same name")
      ->type_name("FILE.ply");
  map->add_option("--heat-limit", options->request.heat_limit_m, "Error in full red")
      ->type_name("METRES")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  map->add_option("--threads", options->request.threads, "0: all that there are")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  map->add_flag("--json", options->json, "Print JSON");
  map->add_flag("--quiet", options->request.quiet, "No progress");
  map->callback([options, &exit_code] { exit_code = EvalMap(*options); });
}

}  // namespace covsplat
