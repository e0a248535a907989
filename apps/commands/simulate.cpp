#include "apps/simulate.hpp"

#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/config_options.hpp"
#include "apps/interrupt.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/core/sensor_presets.hpp"
#include "covsplat/sim/motion.hpp"
#include "covsplat/sim/worlds.hpp"

namespace covsplat {
namespace {

struct SimulateOptions {
  std::string world;
  std::string out;
  std::string sensor;
  std::string motion;
  std::string path;
  std::string preview;
  double preview_at = 0.5;
  bool overwrite = false;
  bool list = false;
  bool json = false;
  bool settings = false;
  bool quiet = false;
  int scans = 0;
  int seed = -1;
  int laps = 0;
  ConfigOptions config;
};

// Worlds, motions and sensors with their descriptions.
template <class Kinds>
void PrintKinds(std::string_view title, const Kinds& kinds) {
  fmt::print("{}\n", title);
  for (const auto& kind : kinds) fmt::print("  {:<12} {}\n", kind.name, kind.description);
}

template <class Kinds>
nlohmann::json JsonOf(const Kinds& kinds) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& kind : kinds) {
    list.push_back({{"name", kind.name}, {"description", kind.description}});
  }
  return list;
}

ExitCode List(bool as_json) {
  if (as_json) {
    const nlohmann::json all = {{"worlds", JsonOf(Worlds())},
                                {"motions", JsonOf(MotionKinds())},
                                {"sensors", JsonOf(SensorPresets())}};
    fmt::print("{}\n", all.dump(2));
    return kExitOk;
  }
  PrintKinds("worlds (or the file of a mesh: .ply, .obj, .gltf, .glb, .stl)", Worlds());
  PrintKinds("motions", MotionKinds());
  PrintKinds("sensors", SensorPresets());
  return kExitOk;
}

// What the flags say goes before files and assignments.
void ApplyFlags(const SimulateOptions& options, SimulationConfig& config) {
  if (!options.world.empty()) config.world = options.world;
  if (!options.motion.empty()) config.motion = options.motion;
  if (!options.path.empty()) config.route.file = options.path;
  if (options.scans > 0) config.max_scans = options.scans;
  if (options.seed >= 0) config.seed = options.seed;
  if (options.laps > 0) config.laps = options.laps;
}

ExitCode RunSimulate(const SimulateOptions& options) {
  if (options.list) return List(options.json);
  if (options.settings) {
    fmt::print("{}", DescribeConfig(SimulationConfig()));
    return kExitOk;
  }
  if (options.world.empty() && options.config.files.empty()) {
    return ReportError({ErrorCode::kUsage, "name a world to simulate; --list shows what there is"});
  }
  if (options.out.empty() && options.preview.empty()) {
    return ReportError({ErrorCode::kUsage,
                        "choose a folder for the recording with -o, or a picture with --preview"});
  }
  Result<SimulationConfig> config = ResolveSimulation(options.config, options.sensor);
  if (!config) return ReportError(config.error());
  ApplyFlags(options, *config);
  if (!options.preview.empty()) {
    const ExitCode drawn = Preview(*config, options.preview, options.preview_at);
    if (drawn != kExitOk || options.out.empty()) return drawn;
  }
  const InterruptGuard guard;
  return Simulate({*config, options.out, options.overwrite, options.quiet});
}

}  // namespace

void AddSimulateCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* simulate = app.add_subcommand("simulate", "Record a simulated walk with exact truth");
  simulate
      ->add_option(
          "world", options->world, "World to move through, or the file of a mesh; see --list")
      ->type_name("");
  simulate->add_option("-o,--out", options->out, "Folder of the recording")->type_name("DIR");
  simulate->add_flag("--overwrite", options->overwrite, "Replace an earlier simulated recording");
  simulate->add_flag("--list", options->list, "List the worlds, motions and sensors");
  simulate->add_flag("--json", options->json, "List as JSON");
  simulate->add_flag("--settings", options->settings, "List what -c and -s can set, and exit");
  simulate->add_option("--sensor", options->sensor, "Sensor to simulate; default: os0-64")
      ->type_name("NAME");
  simulate->add_option("--motion", options->motion, "How it moves; default: as suits the world")
      ->type_name("NAME");
  simulate->add_option("--path", options->path, "Poses to move along, TUM or KITTI")
      ->type_name("FILE");
  simulate->add_option("--laps", options->laps, "Times round the world's way")
      ->check(CLI::Range(1, 100));
  simulate->add_option("-n,--n-scans", options->scans, "Stop after so many scans")
      ->check(CLI::PositiveNumber);
  simulate->add_option("--seed", options->seed, "Of the world's details and of the walk")
      ->check(CLI::NonNegativeNumber);
  simulate->add_option("--preview", options->preview, "Draw what is around the sensor; needs no -o")
      ->type_name("FILE.png");
  simulate->add_option("--preview-at", options->preview_at, "Where, as a share of the way")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  AddConfigOptions(*simulate, options->config);
  simulate->add_flag("--quiet", options->quiet, "Print warnings and errors only");
  simulate->callback([options, &exit_code] { exit_code = RunSimulate(*options); });
}

}  // namespace covsplat
