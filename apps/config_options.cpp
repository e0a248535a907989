#include "apps/config_options.hpp"

#include <CLI/CLI.hpp>

namespace covsplat {

void AddConfigOptions(CLI::App& command, ConfigOptions& options) {
  command.add_option("-c,--config", options.files, "YAML file with what differs from the defaults")
      ->type_name("FILE.yaml")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command.add_option("-s,--set", options.overrides, "Set one value; may be given many times")
      ->type_name("section.key=value")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

}  // namespace covsplat
