// The command line: one binary, one verb per task.
#include <cstdio>
#include <exception>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "apps/commands/commands.hpp"
#include "apps/exit_code.hpp"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace covsplat {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 ok, 2 usage or configuration, 3 input, 4 output, 5 unavailable, 130 interrupted";

int Run(int argc, char** argv) {
  int exit_code = kExitOk;
  CLI::App app("LiDAR-only Gaussian-splatting SLAM", "covsplat");
  app.set_version_flag("--version", "covsplat " COVSPLAT_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of every command");
  app.footer(kFooter);
  app.require_subcommand(1);
  AddRunCommand(app, exit_code);
  AddOptimizeCommand(app, exit_code);
  AddDemoCommand(app, exit_code);
  AddSimulateCommand(app, exit_code);
  AddInfoCommand(app, exit_code);
  AddEvalCommand(app, exit_code);
  AddMeshCommand(app, exit_code);
  AddRenderCommand(app, exit_code);
  AddExportCommand(app, exit_code);
  AddBenchCommand(app, exit_code);
  AddConfigCommand(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {  // help and version
    return app.exit(request);
  } catch (const CLI::ParseError& error) {
    return ReportError(
        {ErrorCode::kUsage, fmt::format("{}; --help lists what there is", error.what())});
  }
  return exit_code;
}

}  // namespace
}  // namespace covsplat

int main(int argc, char** argv) {
  // Tables that grow all the time, with what is freed of them left in the heap, would take twice
  // the memory: by itself malloc raises the first to 32 MB. What is smaller is needed again with
  // the next keyframe, and is kept.
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
  try {
    return covsplat::Run(argc, argv);
  } catch (const std::bad_alloc&) {
    return covsplat::ReportError({covsplat::ErrorCode::kUnavailable, "out of memory"});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "covsplat: internal error: %s\n", error.what());
    return 1;
  }
}
