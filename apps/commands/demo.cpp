#include <memory>

#include "apps/command_line.hpp"
#include "apps/commands/commands.hpp"
#include "apps/config_options.hpp"
#include "apps/interrupt.hpp"
#include "apps/simulate.hpp"
#include "apps/slam_run.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace covsplat {
namespace {

struct DemoOptions {
  std::string out;
  bool overwrite = false;
  bool quiet = false;
  int scans = 300;
  ConfigOptions config;
};

ExitCode RunDemo(const DemoOptions& options) {
  Result<AppConfig> config = ResolveConfig<AppConfig>(options.config);
  if (!config) return ReportError(config.error());
  RunFolderRequest folder;
  if (!options.out.empty()) folder.out = options.out;
  folder.overwrite = options.overwrite;
  const auto made = MakeRunFolder(folder, std::time(nullptr));
  if (!made) return ReportError(made.error());

  const InterruptGuard guard;
  SimulateRequest simulate;
  simulate.config.max_scans = options.scans;
  simulate.folder = *made / "recording";
  simulate.overwrite = true;
  simulate.quiet = options.quiet;
  if (const ExitCode code = Simulate(simulate); code != kExitOk) return code;

  RunRequest run;
  run.recording = simulate.folder;
  run.title = "covsplat demo";
  run.folder = {*made, true};
  run.config = std::move(*config);
  run.quiet = options.quiet;
  run.command_line = CommandLine();
  return RunSlam(run);
}

}  // namespace

void AddDemoCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<DemoOptions>();
  CLI::App* demo = app.add_subcommand("demo", "Simulate a courtyard, map it and show the result");
  demo->add_option("-o,--out", options->out, "Output folder; default: covsplat_out/<date_time>")
      ->type_name("DIR");
  demo->add_flag("--overwrite", options->overwrite, "Replace the files of an earlier demo");
  demo->add_option("-n,--n-scans", options->scans, "Scans to simulate")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  AddConfigOptions(*demo, options->config);
  demo->add_flag("--quiet", options->quiet, "Print warnings and errors only");
  demo->callback([options, &exit_code] { exit_code = RunDemo(*options); });
}

}  // namespace covsplat
