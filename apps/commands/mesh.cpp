#include <chrono>
#include <filesystem>
#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/config_options.hpp"
#include "apps/exit_code.hpp"
#include "apps/finished_run.hpp"
#include "apps/interrupt.hpp"
#include "apps/progress.hpp"
#include "apps/system_info.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "covsplat/io/mesh_writer.hpp"
#include "covsplat/mesh/map_mesher.hpp"
#include "covsplat/mesh/poisson.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

struct MeshOptions {
  std::string run;
  std::string method;
  std::string out;
  double voxel_m = 0.0;
  int threads = 0;
  bool quiet = false;
  ConfigOptions config;
};

Result<MeshConfig> ConfigOf(const MeshOptions& options) {
  ConfigOptions all = options.config;
  if (!options.method.empty()) all.overrides.push_back("method=" + options.method);
  Result<MeshConfig> config = ResolveConfig<MeshConfig>(all);
  if (!config) return config;
  if (options.voxel_m > 0.0) config->voxel_m = options.voxel_m;
  if (options.threads > 0) config->threads = options.threads;
  if (const Result<void> valid = CheckConfig(*config); !valid) return Forward(valid);
  return config;
}

void PrintSummary(const MeshResult& result, const std::filesystem::path& out) {
  std::error_code ignored;
  const auto bytes = static_cast<double>(std::filesystem::file_size(out, ignored));
  fmt::print("mesh        {}: {} triangles, {} vertices, {}\n",
             out.string(),
             FormatCount(static_cast<double>(result.mesh.triangles.size())),
             FormatCount(static_cast<double>(result.mesh.vertices.size())),
             FormatBytes(bytes));
  const std::string voxels = FormatMetres(result.voxel_m);
  if (result.views > 0) {
    fmt::print("            voxels of {} from {} views\n", voxels, result.views);
  } else {
    fmt::print("            cells of about {} around the Gaussians\n", voxels);
  }
}

/// Ctrl-C ends it with nothing written.
Result<MeshResult> FuseViews(const FinishedRun& run,
                             const SensorModel& sensor,
                             const MeshConfig& config,
                             bool quiet) {
  const InterruptGuard guard;
  Progress::Options progress_options;
  progress_options.quiet = quiet;
  Progress progress(progress_options);
  auto last = std::chrono::steady_clock::now();
  const auto on_progress = [&](const MeshProgress& now) {
    const auto time = std::chrono::steady_clock::now();
    ProgressStatus status;
    status.unit = "view";
    status.ms_per_scan = std::chrono::duration<double, std::milli>(time - last).count();
    last = time;
    status.done = static_cast<std::int64_t>(now.done);
    status.total = static_cast<std::int64_t>(now.total);
    status.gaussians = -1;
    status.rss_bytes = ReadMemoryUse().rss_bytes;
    progress.Update(status);
    return !Interrupted();
  };
  const SlamConfig& slam = run.config.slam;
  Result<MeshResult> result = MeshOfMap(run.map,
                                        ChooseViews(run.map, run.trajectory, config.view.spacing_m),
                                        sensor,
                                        slam.system.backend,
                                        slam.mapper.engine.raster,
                                        config,
                                        on_progress);
  progress.Finish();
  return result;
}

/// Poisson needs the Gaussians alone, fusion also where they were seen from.
Result<MeshResult> MakeMesh(const MeshOptions& options,
                            const FinishedRun& run,
                            const MeshConfig& config) {
  if (config.method == MeshMethod::kPoisson) return PoissonOfMap(run.map, config);
  const Result<SensorModel> sensor = SensorOfRun(run, options.run);
  if (!sensor) return Forward(sensor);
  return FuseViews(run, *sensor, config, options.quiet);
}

ExitCode RunMesh(const MeshOptions& options) {
  const Result<MeshConfig> config = ConfigOf(options);
  if (!config) return ReportError(config.error());
  const std::filesystem::path out = options.out.empty() ? FolderOfRun(options.run) / "mesh.ply"
                                                        : std::filesystem::path(options.out);
  if (const auto format = MeshFormatOf(out); !format) return ReportError(format.error());
  const Result<FinishedRun> run = ReadRun(options.run);
  if (!run) return ReportError(run.error());
  if (run->broken > 0) {
    ReportWarning(fmt::format("{} Gaussians that are not finite are left out", run->broken));
  }
  const Result<MeshResult> result = MakeMesh(options, *run, *config);
  if (!result) return ReportError(result.error());
  if (result->interrupted) return kExitInterrupted;
  if (const auto written = WriteMesh(out, result->mesh); !written) {
    return ReportError(written.error());
  }
  if (!options.quiet) PrintSummary(*result, out);
  return kExitOk;
}

}  // namespace

void AddMeshCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MeshOptions>();
  CLI::App* mesh = app.add_subcommand("mesh", "Make a triangle mesh of a finished run's map");
  mesh->add_option("run", options->run, "Folder that `covsplat run` wrote, or a .csmap")
      ->type_name("")
      ->required();
  mesh->add_option("-o,--out",
                   options->out,
                   "Mesh to write: .ply, .obj or .glb; default: mesh.ply in the run's folder")
      ->type_name("FILE");
  mesh->add_option("--method",
                   options->method,
                   "fusion (default) or poisson; poisson needs a build with Open3D")
      ->check(CLI::IsMember({"fusion", "poisson"}));
  mesh->add_option("--voxel", options->voxel_m, "Edge of a voxel in metres; default: from the map")
      ->check(CLI::PositiveNumber);
  AddConfigOptions(*mesh, options->config);
  mesh->add_option("--threads", options->threads, "Threads in all; default: one per processor")
      ->check(CLI::PositiveNumber);
  mesh->add_flag("--quiet", options->quiet, "Print warnings and errors only");
  mesh->callback([options, &exit_code] { exit_code = RunMesh(*options); });
}

}  // namespace covsplat
