#include <cstdio>
#include <memory>
#include <string>

#include "apps/app_config.hpp"
#include "apps/commands/commands.hpp"
#include "apps/config_options.hpp"
#include "apps/exit_code.hpp"
#include <CLI/CLI.hpp>

#include "covsplat/mesh/mesh_config.hpp"
#include "covsplat/sim/simulation.hpp"

namespace covsplat {
namespace {

constexpr const char* kReferenceHead =
    "# Configuration\n\n"
    "Every key with its default. A file given with `-c` holds only what differs; `-s "
    "section.key=value`\n"
    "sets one value. `covsplat config dump` prints the whole configuration of a run as YAML.\n"
    "`mesh` and `simulate` have [keys](#keys-of-covsplat-mesh) [of their "
    "own](#keys-of-covsplat-simulate).\n"
    "This page is made by `make docs`.\n\n";

int Print(const std::string& text) {
  const bool printed = std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return printed ? kExitOk : ReportError({ErrorCode::kOutput, "cannot write to standard output"});
}

std::string Reference() {
  return kReferenceHead + DescribeConfig(AppConfig()) + "\n# Keys of `covsplat mesh`\n" +
         DescribeConfig(MeshConfig()) + "\n# Keys of `covsplat simulate`\n" +
         DescribeConfig(SimulationConfig());
}

int Dump(const ConfigOptions& options) {
  const Result<AppConfig> config = ResolveConfig<AppConfig>(options);
  return config ? Print(DumpYaml(*config)) : ReportError(config.error());
}

int Check(const ConfigOptions& options) {
  const Result<AppConfig> config = ResolveConfig<AppConfig>(options);
  if (!config) return ReportError(config.error());
  const Result<void> valid = CheckSlamConfig(config->slam);
  if (!valid) return ReportError(valid.error());
  return Print("the configuration is valid\n");
}

}  // namespace

void AddConfigCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ConfigOptions>();
  CLI::App* config = app.add_subcommand("config", "Show, check and describe the configuration");
  config->require_subcommand(1);

  CLI::App* dump = config->add_subcommand("dump", "Print the resolved configuration as YAML");
  AddConfigOptions(*dump, *options);
  dump->callback([options, &exit_code] { exit_code = Dump(*options); });

  CLI::App* check = config->add_subcommand("check", "Check configuration files");
  check->add_option("FILE", options->files, "YAML files, applied in this order")->type_name("");
  AddConfigOptions(*check, *options);
  check->callback([options, &exit_code] { exit_code = Check(*options); });

  CLI::App* describe = config->add_subcommand("describe", "Print the reference of all keys");
  describe->callback([&exit_code] { exit_code = Print(Reference()); });
}

}  // namespace covsplat
