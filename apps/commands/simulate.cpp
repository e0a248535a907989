#include "apps/simulate.hpp"

#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/config_options.hpp"
#include "apps/interrupt.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "covsplat/sim/worlds.hpp"

namespace covsplat {
namespace {

struct SimulateOptions {
  std::string world;
  std::string out;
  bool overwrite = false;
  bool list = false;
  bool quiet = false;
  int scans = 0;
  int seed = -1;
  ConfigOptions config;
};

ExitCode ListWorlds() {
  for (const std::string_view name : WorldNames()) fmt::print("{}\n", name);
  return kExitOk;
}

ExitCode RunSimulate(const SimulateOptions& options) {
  if (options.list) return ListWorlds();
  if (options.world.empty() && options.config.files.empty()) {
    return ReportError({ErrorCode::kUsage, "name a world to simulate; --list shows what there is"});
  }
  if (options.out.empty()) {
    return ReportError({ErrorCode::kUsage, "choose a folder for the recording with -o"});
  }
  Result<SimulationConfig> config = ResolveConfig<SimulationConfig>(options.config);
  if (!config) return ReportError(config.error());
  if (!options.world.empty()) config->world = options.world;
  if (options.scans > 0) config->max_scans = options.scans;
  if (options.seed >= 0) config->seed = options.seed;
  const InterruptGuard guard;
  return Simulate({*config, options.out, options.overwrite, options.quiet});
}

}  // namespace

void AddSimulateCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* simulate = app.add_subcommand("simulate", "Record a simulated walk with exact truth");
  simulate->add_option("world", options->world, "World to walk through; see --list")->type_name("");
  simulate->add_option("-o,--out", options->out, "Folder of the recording")->type_name("DIR");
  simulate->add_flag("--overwrite", options->overwrite, "Replace an earlier simulated recording");
  simulate->add_flag("--list", options->list, "List the worlds");
  simulate->add_option("-n,--n-scans", options->scans, "Stop after so many scans")
      ->check(CLI::PositiveNumber);
  simulate->add_option("--seed", options->seed, "Of the world's details and of the walk")
      ->check(CLI::NonNegativeNumber);
  AddConfigOptions(*simulate, options->config);
  simulate->add_flag("--quiet", options->quiet, "Print warnings and errors only");
  simulate->callback([options, &exit_code] { exit_code = RunSimulate(*options); });
}

}  // namespace covsplat
