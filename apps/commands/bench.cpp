#include <algorithm>
#include <memory>

#include "apps/bench_run.hpp"
#include "apps/bench_table.hpp"
#include "apps/command_line.hpp"
#include "apps/commands/commands.hpp"
#include "apps/config_options.hpp"
#include "apps/interrupt.hpp"
#include "apps/shipped_configs.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

struct BenchOptions {
  std::string data_set;
  std::string root;
  std::string out;
  std::vector<std::string> only;
  BenchRequest request;
  ConfigOptions config;
  std::int64_t scans = 0;
  int threads = 0;
  bool no_map = false;
  bool json = false;
};

/// The data set's own configuration, then files and assignments.
Result<AppConfig> ConfigOf(const BenchOptions& options) {
  const auto shipped = ShippedConfig(options.data_set);
  COVSPLAT_CHECK(shipped.has_value());
  AppConfig config;
  const auto loaded = LoadYamlText(*shipped, "configs/" + options.data_set + ".yaml", config);
  if (!loaded) return Forward(loaded);
  ConfigOptions given = options.config;
  if (options.threads > 0) {
    given.overrides.push_back("system.threads=" + std::to_string(options.threads));
  }
  return ResolveConfig(given, config);
}

/// Leaves the sequences that were asked for.
Result<void> Choose(const std::vector<std::string>& only, DataSetContent& content) {
  if (only.empty()) return {};
  const auto asked = [&](const std::string& name) {
    return std::find(only.begin(), only.end(), name) != only.end();
  };
  std::erase_if(content.sequences, [&](const DataSequence& s) { return !asked(s.name); });
  std::erase_if(content.missing, [&](const MissingSequence& s) { return !asked(s.name); });
  if (!content.sequences.empty()) return {};
  return Fail(ErrorCode::kUsage,
              "--sequence {}: is not there{}",
              fmt::join(only, ", "),
              content.missing.empty() ? std::string(" or has another name")
                                      : ": " + content.missing.front().reason);
}

ExitCode Bench(const BenchOptions& options) {
  const Result<AppConfig> config = ConfigOf(options);
  if (!config) return ReportError(config.error());
  Result<DataSetContent> content = FindSequences(options.data_set, options.root);
  if (!content) return ReportError(content.error());
  if (const auto chosen = Choose(options.only, *content); !chosen) {
    return ReportError(chosen.error());
  }
  BenchRequest request = options.request;
  request.config = *config;
  request.out = options.out.empty() ? "covsplat_bench/" + options.data_set : options.out;
  request.map = !options.no_map;
  request.quiet |= options.json;
  if (options.scans > 0) request.max_scans = options.scans;
  request.command_line = CommandLine();

  const InterruptGuard guard;
  std::vector<BenchResult> results;
  for (const DataSequence& sequence : content->sequences) {
    if (Interrupted()) break;
    if (!request.quiet) {
      fmt::print("\n{} ({} of {})\n", sequence.name, results.size() + 1, content->sequences.size());
    }
    results.push_back(BenchSequence(sequence, request));
  }
  const auto text = options.json ? BenchJson : BenchTable;
  fmt::print("{}{}", options.json ? "" : "\n", text(options.data_set, results, content->missing));
  if (Interrupted()) return kExitInterrupted;
  for (const BenchResult& result : results) {
    if (result.exit_code != kExitOk) return result.exit_code;
    if (result.map_exit_code != kExitOk) return result.map_exit_code;
  }
  return kExitOk;
}

}  // namespace

void AddBenchCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<BenchOptions>();
  BenchRequest& request = options->request;
  CLI::App* bench =
      app.add_subcommand("bench", "Run the paper's sequences of a data set, beside its figures");
  bench->add_option("data_set", options->data_set, "kitti, newer_college or oxford_spires")
      ->type_name("")
      ->required()
      ->check(CLI::IsMember(DataSetNames()));
  bench->add_option("--root", options->root, "Folder of the data set; see docs/benchmarks.md")
      ->type_name("DIR")
      ->required();
  bench->add_option("-o,--out", options->out, "Output folder; default: covsplat_bench/<data set>")
      ->type_name("DIR");
  bench->add_flag("--overwrite", request.overwrite, "Replace the files of earlier runs");
  bench->add_option("--sequence", options->only, "Only this one; may be given many times")
      ->type_name("NAME")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  bench->add_option("-n,--n-scans", options->scans, "Track at most so many scans of each")
      ->check(CLI::PositiveNumber);
  bench->add_option("--voxel", request.voxel_m, "Edge of a voxel of the meshes, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  bench->add_flag("--no-map", options->no_map, "Judge trajectories only");
  AddConfigOptions(*bench, options->config);
  bench->add_option("--threads", options->threads, "Threads in all; default: one per processor")
      ->check(CLI::PositiveNumber);
  bench->add_flag("--json", options->json, "Print JSON");
  bench->add_flag("--quiet", request.quiet, "Print the table, warnings and errors only");
  bench->callback([options, &exit_code] { exit_code = Bench(*options); });
}

}  // namespace covsplat
