// A finished run once more, with all that is known in the end.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/config_options.hpp"
#include "apps/exit_code.hpp"
#include "apps/run_folder.hpp"

namespace covsplat {

struct OptimizeRequest {
  std::filesystem::path run;                       ///< folder of a finished run
  std::optional<std::filesystem::path> recording;  ///< of the run, if it has moved
  /// A .g2o file, the run's own with edges or priors added: its solution corrects the trajectory.
  std::optional<std::filesystem::path> graph;
  RunFolderRequest folder;
  ConfigOptions config;         ///< on top of the run's own
  int steps_per_keyframe = 20;  ///< over all views, when the map is made
  bool quiet = false;
  std::string command_line;
};

/// Global refinement. The run's trajectory is taken as odometry for a first pass, into the folder
/// `loops`, which looks at every place for loops, solves the pose graph and stitches the surfaces
/// of all passes. A second pass makes the map anew with these poses, so that no surface was ever
/// made twice, and optimises it over all views. Both in lockstep: the same every time. Prints like
/// RunSlam.
ExitCode OptimizeRun(const OptimizeRequest& request);

}  // namespace covsplat
