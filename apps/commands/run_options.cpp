#include "apps/commands/run_options.hpp"

#include "apps/command_line.hpp"
#include <CLI/CLI.hpp>

namespace covsplat {
namespace {

void AddInputFlags(CLI::App& command, RunOptions& o) {
  command.add_option("recording", o.recording, "Folder of scans")->type_name("")->required();
  command.add_option("-n,--n-scans", o.scans, "Track at most so many scans")
      ->check(CLI::PositiveNumber);
  command.add_option("-j,--jump", o.jump, "Track every n-th scan only")->check(CLI::PositiveNumber);
  command.add_option("--first", o.first, "Leave out so many scans at the start")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--format", o.format, "Kind of the scan files: auto, kitti, pcd or ply");
  command.add_option("--kitti-correction",
                     o.kitti_correction_deg,
                     "Degrees to add to the elevation of KITTI's points (0.195 to 0.205)");
  command.add_option("--gt", o.truth, "Ground truth to evaluate against (TUM or KITTI poses)")
      ->type_name("FILE");
  command.add_option("--poses", o.poses, "Map with these poses instead of tracking")
      ->type_name("FILE");
  CLI::Option* realtime =
      command.add_flag("--realtime", o.realtime, "Feed scans at the times of their stamps");
  command.add_option("--rate", o.rate, "... so many times as fast")
      ->check(CLI::Range(0.01, 100.0))
      ->needs(realtime);
}

}  // namespace

void AddRunOptions(CLI::App& command, RunOptions& o) {
  AddInputFlags(command, o);
  command.add_option("-o,--out", o.out, "Output folder; default: covsplat_out/<date_time>")
      ->type_name("DIR");
  command.add_flag("--overwrite", o.overwrite, "Replace the files of an earlier run");
  AddConfigOptions(command, o.config);
  command.add_option("--threads", o.threads, "Threads in all; default: one per processor")
      ->check(CLI::PositiveNumber);
  command.add_option("--backend", o.backend, "Where to render and optimise: cpu, cuda or auto");
  command.add_option(
      "--loops", o.loops, "Places seen again correct the map: on, off or offline (at the end)");
  command.add_flag("--deterministic",
                   o.deterministic,
                   "Track and map in turns: the same output every time, for any thread count");
  command.add_flag("--quiet", o.quiet, "Print warnings and errors only");
}

Result<RunRequest> RequestOf(const RunOptions& o) {
  ConfigOptions config = o.config;
  const auto set = [&](const std::string& assignment) { config.overrides.push_back(assignment); };
  if (o.threads > 0) set("system.threads=" + std::to_string(o.threads));
  if (!o.backend.empty()) set("system.backend=" + o.backend);
  if (!o.loops.empty()) set("loops.mode=" + o.loops);
  if (!o.format.empty()) set("input.format=" + o.format);
  if (o.deterministic) set("system.schedule=lockstep");
  Result<AppConfig> resolved = ResolveConfig<AppConfig>(config);
  if (!resolved) return Forward(resolved);
  if (o.kitti_correction_deg != 0.0) {
    resolved->input.kitti_elevation_correction_deg = o.kitti_correction_deg;
  }
  if (const Result<void> valid = CheckConfig(*resolved); !valid) return Forward(valid);

  RunRequest request;
  request.recording = o.recording;
  if (!o.out.empty()) request.folder.out = o.out;
  request.folder.overwrite = o.overwrite;
  request.config = std::move(*resolved);
  request.first_scan = o.first;
  if (o.scans > 0) request.max_scans = o.scans;
  request.jump = o.jump;
  if (o.realtime) request.realtime_rate = o.rate;
  request.quiet = o.quiet;
  if (!o.truth.empty()) request.truth = o.truth;
  if (!o.poses.empty()) request.poses = o.poses;
  request.command_line = CommandLine();
  return request;
}

}  // namespace covsplat
