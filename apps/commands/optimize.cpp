#include <memory>

#include "apps/command_line.hpp"
#include "apps/commands/commands.hpp"
#include "apps/interrupt.hpp"
#include "apps/optimize_run.hpp"
#include <CLI/CLI.hpp>

namespace covsplat {
namespace {

struct OptimizeOptions {
  std::string run;
  std::string recording;
  std::string graph;
  std::string out;
  bool overwrite = false;
  ConfigOptions config;
  int steps = 20;
  int threads = 0;
  std::string backend;
  bool quiet = false;
};

OptimizeRequest RequestOf(const OptimizeOptions& o) {
  OptimizeRequest request;
  request.run = o.run;
  if (!o.recording.empty()) request.recording = o.recording;
  if (!o.graph.empty()) request.graph = o.graph;
  if (!o.out.empty()) request.folder.out = o.out;
  request.folder.overwrite = o.overwrite;
  request.config = o.config;
  const auto set = [&](const std::string& text) { request.config.overrides.push_back(text); };
  if (o.threads > 0) set("system.threads=" + std::to_string(o.threads));
  if (!o.backend.empty()) set("system.backend=" + o.backend);
  request.steps_per_keyframe = o.steps;
  request.quiet = o.quiet;
  request.command_line = CommandLine();
  return request;
}

}  // namespace

void AddOptimizeCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<OptimizeOptions>();
  CLI::App* optimize = app.add_subcommand(
      "optimize", "Refine a finished run: all loops, all surfaces, then the map anew");
  optimize->add_option("run", options->run, "Folder that `covsplat run` wrote")
      ->type_name("")
      ->required();
  optimize
      ->add_option("--recording", options->recording, "Its recording, if it is not where it was")
      ->type_name("DIR");
  optimize
      ->add_option("--graph",
                   options->graph,
                   "Begin with the solution of this pose graph: the run's pose_graph.g2o with "
                   "edges or priors added")
      ->type_name("FILE");
  optimize->add_option("-o,--out", options->out, "Output folder; default: covsplat_out/<date_time>")
      ->type_name("DIR");
  optimize->add_flag("--overwrite", options->overwrite, "Replace the files of an earlier run");
  AddConfigOptions(*optimize, options->config);
  optimize
      ->add_option(
          "--steps", options->steps, "Optimiser steps for each keyframe when the map is there")
      ->capture_default_str()
      ->check(CLI::Range(0, 100000));
  optimize->add_option("--threads", options->threads, "Threads in all; default: the run's")
      ->check(CLI::PositiveNumber);
  optimize->add_option(
      "--backend", options->backend, "Where to render and optimise: cpu, cuda or auto");
  optimize->add_flag("--quiet", options->quiet, "Print warnings and errors only");
  optimize->callback([options, &exit_code] {
    const InterruptGuard guard;
    exit_code = OptimizeRun(RequestOf(*options));
  });
}

}  // namespace covsplat
