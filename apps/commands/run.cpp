#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/commands/run_options.hpp"
#include "apps/interrupt.hpp"
#include <CLI/CLI.hpp>

namespace covsplat {

void AddRunCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* run = app.add_subcommand("run", "Track a recording and map it");
  AddRunOptions(*run, *options);
  run->callback([options, &app, &exit_code] {
    const Result<RunRequest> request = RequestOf(*options);
    if (!request) {
      exit_code = ReportError(request.error());
      return;
    }
    const InterruptGuard guard;
    exit_code = RunSlam(*request);
  });
}

}  // namespace covsplat
