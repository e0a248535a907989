#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

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

constexpr double kMinPointOpacity = 0.1;

struct ExportOptions {
  std::string run;
  std::string out;
  std::string as;
  std::optional<double> min_opacity;
  bool quiet = false;
};

enum class Content { kPoints, kGaussians };

/// By the end of the name and --as. PLY can hold either: between map files it is the map that is
/// converted, of a run it is the cloud, as the run has a map.ply.
Result<Content> ContentOf(const ExportOptions& options, const std::filesystem::path& out) {
  const std::string extension = out.extension().string();
  const bool can_be_points = extension == ".ply" || extension == ".pcd";
  const bool can_be_gaussians = extension != ".pcd" && MapFormatOf(out).has_value();
  if (!can_be_points && !can_be_gaussians) {
    return Fail(ErrorCode::kUsage,
                "{}: cannot tell what to write by \"{}\"; end the name with .csmap, .ply or .spz "
                "for a map, with .ply or .pcd for a cloud",
                out.string(),
                extension);
  }
  std::error_code ignored;
  const bool of_map = std::filesystem::is_regular_file(options.run, ignored);
  const bool wants_points = options.as == "points" ||
                            (options.as.empty() && can_be_points && !(of_map && can_be_gaussians));
  if (wants_points ? can_be_points : can_be_gaussians) {
    return wants_points ? Content::kPoints : Content::kGaussians;
  }
  return Fail(ErrorCode::kUsage,
              "--as {}: {} does not hold them; end the name with {}",
              options.as,
              extension,
              wants_points ? ".ply or .pcd" : ".csmap, .ply or .spz");
}

SavedMap WithoutFaint(const SavedMap& map, double min_opacity) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    if (static_cast<double>(OpacityOf(map.gaussians, i)) >= min_opacity) rows.push_back(i);
  }
  return SelectRows(map, rows);
}

/// PCL's names of normals in PCD; PLY has its own.
PointTable CloudOf(const SavedMap& map, bool pcd) {
  std::array<std::vector<float>, 9> values;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    if (!IsSound(map.gaussians, i)) continue;
    const Eigen::Vector3f mean = MeanOf(map.gaussians, i);
    const Eigen::Vector3f normal = NormalOf(map.gaussians, i).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      values[k].push_back(mean[static_cast<Eigen::Index>(k)]);
      values[k + 3].push_back(normal[static_cast<Eigen::Index>(k)]);
    }
    values[6].push_back(OpacityOf(map.gaussians, i));
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

Result<void> WriteCloud(const std::filesystem::path& out, const SavedMap& map) {
  const bool pcd = out.extension() == ".pcd";
  return pcd ? WritePcd(out, CloudOf(map, pcd)) : WritePly(out, CloudOf(map, pcd));
}

Result<void> WriteMap(const std::filesystem::path& out, const SavedMap& map) {
  return MapFormatOf(out).and_then(
      [&](MapFormat format) { return WriteMapFile(out, format, map); });
}

void PrintSummary(Content content, const std::filesystem::path& out, std::size_t count) {
  if (content == Content::kPoints) {
    fmt::print(
        "cloud       {}: {} points\n", out.string(), FormatCount(static_cast<double>(count)));
    return;
  }
  std::error_code ignored;
  const auto bytes = static_cast<double>(std::filesystem::file_size(out, ignored));
  fmt::print("map         {}: {} Gaussians, {}, {:.1f} bytes each\n",
             out.string(),
             FormatCount(static_cast<double>(count)),
             FormatBytes(bytes),
             bytes / static_cast<double>(count));
}

ExitCode RunExport(const ExportOptions& options) {
  const std::filesystem::path out = options.out.empty() ? FolderOfRun(options.run) / "cloud.ply"
                                                        : std::filesystem::path(options.out);
  const Result<Content> content = ContentOf(options, out);
  if (!content) return ReportError(content.error());
  const Result<MapFile> read = ReadRunMap(options.run);
  if (!read) return ReportError(read.error());
  const bool points = *content == Content::kPoints;
  const double min_opacity = options.min_opacity.value_or(points ? kMinPointOpacity : 0.0);
  const SavedMap map = WithoutFaint(read->map, min_opacity);
  if (map.Size() == 0) {
    return ReportError(
        {ErrorCode::kInput,
         fmt::format(
             "{}: no Gaussian is as opaque as {}; lower --min-opacity", options.run, min_opacity)});
  }
  const Result<void> written = points ? WriteCloud(out, map) : WriteMap(out, map);
  if (!written) return ReportError(written.error());
  if (!options.quiet) PrintSummary(*content, out, map.Size());
  return kExitOk;
}

}  // namespace

void AddExportCommand(CLI::App& app, int& exit_code) {
  const auto o = std::make_shared<ExportOptions>();
  CLI::App* command = app.add_subcommand(
      "export", "Write a finished run's map as a point cloud, or in another format of maps");
  command
      ->add_option("run", o->run, "Folder that `covsplat run` wrote, or a map: .csmap, .ply, .spz")
      ->type_name("")
      ->required();
  command
      ->add_option(
          "-o,--out,--cloud",
          o->out,
          "File to write. Maps: .csmap, .spz, .ply; clouds: .pcd, .ply; default: cloud.ply "
          "in the run's folder")
      ->type_name("FILE");
  command
      ->add_option("--as",
                   o->as,
                   "What a .ply becomes: points (default for a run) or gaussians (default for a "
                   "map file)")
      ->check(CLI::IsMember({"points", "gaussians"}));
  command
      ->add_option("--min-opacity",
                   o->min_opacity,
                   "Leave out Gaussians less opaque than this; default: 0.1 for points, 0 for "
                   "Gaussians")
      ->check(CLI::Range(0.0, 1.0));
  command->add_flag("--quiet", o->quiet, "Print warnings and errors only");
  command->footer(
      "Points have a normal (to the side they were seen from), opacity, confidence and intensity:\n"
      "the mean of what the Gaussian was made of, 0 if the recording has none. A .csmap keeps all\n"
      "of a map with its keyframes and configuration; .spz and .ply are for viewers of splats, "
      "and\n"
      ".spz keeps what these need only.");
  command->callback([o, &exit_code] { exit_code = RunExport(*o); });
}

}  // namespace covsplat
