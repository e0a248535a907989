#include <cmath>
#include <filesystem>
#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/finished_run.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "covsplat/io/pcd.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

struct ExportOptions {
  std::string run;
  std::string out;
  double min_opacity = 0.1;
  bool quiet = false;
};

/// PCL's names of normals in PCD; PLY has its own.
PointTable CloudOf(const SurfelMap& map, double min_opacity, bool pcd) {
  std::array<std::vector<float>, 9> values;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const float opacity = 1.0f / (1.0f + std::exp(-map.gaussians.Column(kOpacityLogit)[i]));
    if (static_cast<double>(opacity) < min_opacity) continue;
    const Eigen::Vector3f mean = MeanOf(map.gaussians, i);
    const Eigen::Vector3f normal = NormalOf(map.gaussians, i).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      values[k].push_back(mean[static_cast<Eigen::Index>(k)]);
      values[k + 3].push_back(normal[static_cast<Eigen::Index>(k)]);
    }
    values[6].push_back(opacity);
    values[7].push_back(map.confidence[i]);
    values[8].push_back(map.intensity[i]);
  }
  const std::array<const char*, 9> names = {"x",
                                            "y",
                                            "z",
                                            pcd ? "normal_x" : "nx",
                                            pcd ? "normal_y" : "ny",
                                            pcd ? "normal_z" : "nz",
                                            "opacity",
                                            "confidence",
                                            "intensity"};
  PointTable table;
  for (std::size_t k = 0; k < names.size(); ++k) {
    table.columns.push_back({names[k], std::move(values[k])});
  }
  return table;
}

Result<bool> IsPcd(const std::filesystem::path& path) {
  if (path.extension() == ".pcd") return true;
  if (path.extension() == ".ply") return false;
  return Fail(ErrorCode::kUsage,
              "{}: cannot tell the format of a cloud by \"{}\"; end the name with .ply or .pcd",
              path.string(),
              path.extension().string());
}

ExitCode RunExport(const ExportOptions& options) {
  const std::filesystem::path out = options.out.empty()
                                        ? std::filesystem::path(options.run) / "cloud.ply"
                                        : std::filesystem::path(options.out);
  const Result<bool> pcd = IsPcd(out);
  if (!pcd) return ReportError(pcd.error());
  const Result<FinishedRun> run = ReadRun(options.run);
  if (!run) return ReportError(run.error());
  const PointTable cloud = CloudOf(run->map, options.min_opacity, *pcd);
  if (cloud.Rows() == 0) {
    return ReportError({ErrorCode::kInput,
                        fmt::format("{}: no Gaussian is as opaque as {}; lower --min-opacity",
                                    options.run,
                                    options.min_opacity)});
  }
  const Result<void> written = *pcd ? WritePcd(out, cloud) : WritePly(out, cloud);
  if (!written) return ReportError(written.error());
  if (!options.quiet) {
    fmt::print("cloud       {}: {} points\n",
               out.string(),
               FormatCount(static_cast<double>(cloud.Rows())));
  }
  return kExitOk;
}

}  // namespace

void AddExportCommand(CLI::App& app, int& exit_code) {
  const auto o = std::make_shared<ExportOptions>();
  CLI::App* command = app.add_subcommand("export", "Write a finished run's map as a point cloud");
  command->add_option("run", o->run, "Folder that `covsplat run` wrote")->type_name("")->required();
  command
      ->add_option("-o,--cloud",
                   o->out,
                   "Cloud to write: .ply or .pcd; default: cloud.ply in the run's folder")
      ->type_name("FILE");
  command->add_option("--min-opacity", o->min_opacity, "Leave out Gaussians less opaque than this")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_flag("--quiet", o->quiet, "Print warnings and errors only");
  command->footer(
      "One point per Gaussian with its normal (to the side it was seen from), opacity, confidence\n"
      "and intensity: the mean of what it was made of, 0 if the recording has none.");
  command->callback([o, &exit_code] { exit_code = RunExport(*o); });
}

}  // namespace covsplat
