#include "apps/commands/commands.hpp"
#include <CLI/CLI.hpp>

namespace covsplat {

void AddEvalCommand(CLI::App& app, int& exit_code) {
  CLI::App* eval = app.add_subcommand("eval", "Measure results against a ground truth");
  eval->require_subcommand(1);
  AddEvalTrajectoryCommand(*eval, exit_code);
  AddEvalMapCommand(*eval, exit_code);
}

}  // namespace covsplat
