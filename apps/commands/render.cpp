#include <chrono>
#include <filesystem>
#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/finished_run.hpp"
#include "apps/interrupt.hpp"
#include "apps/progress.hpp"
#include "apps/render_writer.hpp"
#include "apps/system_info.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "covsplat/core/sensor_presets.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

struct RenderOptions {
  std::string run;
  std::string poses;
  std::string sensor;
  std::string out;
  bool overwrite = false;
  double min_alpha = 0.5;
  int every = 1;
  int threads = 0;
  bool quiet = false;
};

Result<SensorModel> SensorFor(const RenderOptions& options, const FinishedRun& run) {
  if (options.sensor.empty()) return SensorOfRun(run, options.run);
  return FindSensorPreset(options.sensor).and_then(SensorModelOf);
}

Result<Trajectory> PosesFor(const RenderOptions& options, const FinishedRun& run) {
  Trajectory all = run.trajectory;
  if (!options.poses.empty()) {
    std::vector<double> stamps_s;
    for (const TimedPose& pose : run.trajectory) stamps_s.push_back(pose.stamp_s);
    Result<Trajectory> given = LoadTrajectory(options.poses, stamps_s);
    if (!given) return given;
    if (given->empty()) return Fail(ErrorCode::kInput, "{}: has no poses", options.poses);
    all = std::move(*given);
  }
  if (all.empty()) {
    return Fail(
        ErrorCode::kInput, "{}: knows no poses to look from; name some with --poses", options.run);
  }
  Trajectory chosen;
  for (std::size_t i = 0; i < all.size(); i += static_cast<std::size_t>(options.every)) {
    chosen.push_back(all[i]);
  }
  return chosen;
}

/// The number of poses rendered before the end or a signal.
Result<std::size_t> RenderAll(const RenderOptions& options,
                              const SensorModel& sensor,
                              const Trajectory& poses,
                              SplatEngine& engine,
                              RenderWriter& writer) {
  Progress::Options progress_options;
  progress_options.quiet = options.quiet;
  Progress progress(progress_options);
  std::size_t done = 0;
  while (done < poses.size() && !Interrupted()) {
    const auto start = std::chrono::steady_clock::now();
    const RenderOutput render = engine.Render(poses[done].T_world_sensor);
    const auto written = writer.Write(sensor, render, poses[done], options.min_alpha);
    if (!written) return Forward(written);
    ++done;
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    ProgressStatus status;
    status.unit = "view";
    status.done = static_cast<std::int64_t>(done);
    status.total = static_cast<std::int64_t>(poses.size());
    status.ms_per_scan = took.count();
    status.gaussians = -1;
    status.rss_bytes = ReadMemoryUse().rss_bytes;
    progress.Update(status);
  }
  const Result<void> finished = writer.Finish();
  if (!finished) return Forward(finished);
  return done;
}

ExitCode RunRender(const RenderOptions& options) {
  const Result<FinishedRun> run = ReadRun(options.run);
  if (!run) return ReportError(run.error());
  const Result<SensorModel> sensor = SensorFor(options, *run);
  if (!sensor) return ReportError(sensor.error());
  const Result<Trajectory> poses = PosesFor(options, *run);
  if (!poses) return ReportError(poses.error());
  ThreadPool pool(options.threads);
  const SlamConfig& slam = run->config.slam;
  const auto engine =
      MakeMapEngine(run->map, slam.system.backend, *sensor, slam.mapper.engine, pool);
  if (!engine) return ReportError(engine.error());
  const std::filesystem::path out = options.out.empty() ? FolderOfRun(options.run) / "render"
                                                        : std::filesystem::path(options.out);
  Result<RenderWriter> writer = RenderWriter::Create(out, options.overwrite);
  if (!writer) return ReportError(writer.error());
  const InterruptGuard guard;
  const Result<std::size_t> done = RenderAll(options, *sensor, *poses, **engine, *writer);
  if (!done) return ReportError(done.error());
  if (!options.quiet) {
    fmt::print("rendered    {}: {} views of {} x {} pixels\n",
               out.string(),
               *done,
               sensor->Rows(),
               sensor->Columns());
  }
  return Interrupted() ? kExitInterrupted : kExitOk;
}

}  // namespace

void AddRenderCommand(CLI::App& app, int& exit_code) {
  const auto o = std::make_shared<RenderOptions>();
  CLI::App* render =
      app.add_subcommand("render", "Show a finished run's map as a LiDAR would see it");
  render
      ->add_option("run", o->run, "Folder that `covsplat run` wrote, or a map: .csmap, .ply, .spz")
      ->type_name("")
      ->required();
  render
      ->add_option("--poses",
                   o->poses,
                   "Where to look from, in the map's frame (TUM, or KITTI with as many poses as "
                   "the run has scans); default: the run's own poses")
      ->type_name("FILE");
  render->add_option("--every", o->every, "Render every n-th pose only")
      ->check(CLI::PositiveNumber);
  std::string known;
  for (const SensorPreset& preset : SensorPresets()) {
    if (!preset.elevation_deg.empty()) known += fmt::format(" {}", preset.name);
  }
  render
      ->add_option(
          "--sensor", o->sensor, "Sensor to render; default: the run's own. Known:" + known)
      ->type_name("PRESET");
  render->add_option("-o,--out", o->out, "Output folder; default: render in the run's folder")
      ->type_name("DIR");
  render->add_flag("--overwrite", o->overwrite, "Replace what was rendered there before");
  render->add_option("--min-opacity", o->min_alpha, "Pixels less opaque than this have no return")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1.0));
  render->add_option("--threads", o->threads, "Threads in all; default: one per processor")
      ->check(CLI::PositiveNumber);
  render->add_flag("--quiet", o->quiet, "Print warnings and errors only");
  render->footer(
      "range/ holds 16-bit PNGs in steps of 1/256 m, normal/ and opacity/ 8-bit ones; velodyne/ "
      "with\n"
      "times.txt is a recording that `covsplat run` reads (its intensity is the rendered "
      "opacity).");
  render->callback([o, &exit_code] { exit_code = RunRender(*o); });
}

}  // namespace covsplat
