// The flags -c and -s, which every command that needs a configuration shares.
#pragma once

#include <string>
#include <vector>

#include "covsplat/config/config.hpp"

namespace CLI {
class App;
}

namespace covsplat {

/// Where a configuration comes from: defaults, then the files, then the assignments, in order.
struct ConfigOptions {
  std::vector<std::string> files;
  std::vector<std::string> overrides;  ///< "section.key=value"
};

/// Adds -c/--config and -s/--set; `options` must outlive the parsing.
void AddConfigOptions(CLI::App& command, ConfigOptions& options);

/// `config` holds the defaults to start from.
template <class Config>
Result<Config> ResolveConfig(const ConfigOptions& options, Config config = Config()) {
  for (const std::string& file : options.files) {
    if (const Result<void> loaded = LoadYaml(file, config); !loaded) return Forward(loaded);
  }
  for (const std::string& assignment : options.overrides) {
    const Result<void> applied = ApplyOverride(assignment, config);
    if (!applied) return Fail(ErrorCode::kUsage, "--set {}", applied.error().message);
  }
  return config;
}

}  // namespace covsplat
