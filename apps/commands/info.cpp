#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/exit_code.hpp"
#include "apps/facts.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

Result<Json> FactsOf(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) return MapFacts(path);
  if (fs::is_regular_file(path / "metrics.json", ignored)) return RunFacts(path);
  return RecordingFacts(path);
}

/// One line per fact, nested ones indented; lists of numbers in one line.
void Print(const Json& facts, int indent) {
  for (const auto& [key, value] : facts.items()) {
    const int width = std::max(1, 26 - indent);
    fmt::print("{:{}}{:{}} ", "", indent, key, width);
    const bool texts = value.is_array() && !value.empty() && !value.front().is_number();
    if (value.is_object()) {
      fmt::print("\n");
      Print(value, indent + 2);
    } else if (value.is_string()) {
      fmt::print("{}\n", value.get<std::string>());
    } else if (texts && value.front().is_string()) {
      fmt::print("\n");
      for (const Json& text : value) fmt::print("  - {}\n", text.get<std::string>());
    } else {
      fmt::print("{}\n", texts ? fmt::format("{} entries", value.size()) : value.dump());
    }
  }
}

ExitCode Info(const std::string& path, bool json) {
  const Result<Json> facts = FactsOf(path);
  if (!facts) return ReportError(facts.error());
  if (json) {
    fmt::print("{}\n", facts->dump(2, ' ', false, Json::error_handler_t::replace));
  } else {
    Print(*facts, 0);
  }
  return kExitOk;
}

}  // namespace

void AddInfoCommand(CLI::App& app, int& exit_code) {
  const auto path = std::make_shared<std::string>();
  const auto json = std::make_shared<bool>(false);
  CLI::App* info = app.add_subcommand("info", "Show what a recording, a map or a run holds");
  info->add_option("path", *path, "Folder of scans, map (.csmap, .ply, .spz), or folder of a run")
      ->type_name("")
      ->required();
  info->add_flag("--json", *json, "Print JSON");
  info->callback([path, json, &exit_code] { exit_code = Info(*path, *json); });
}

}  // namespace covsplat
