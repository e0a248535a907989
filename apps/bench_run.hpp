// `covsplat bench`: one sequence of a data set, from its scans to figures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/app_config.hpp"
#include "apps/data_sets.hpp"
#include "apps/exit_code.hpp"

namespace covsplat {

struct BenchRequest {
  std::filesystem::path out;  ///< the run of a sequence becomes a folder of its name in it
  bool overwrite = false;
  bool quiet = false;
  bool map = true;  ///< mesh and judge the map where the true surface is there
  double voxel_m = 0.1;
  std::int64_t max_scans = -1;
  AppConfig config;
  std::string command_line;
};

/// As `covsplat eval map` found it, by the paper's protocol.
struct BenchMapResult {
  double accuracy_cm = 0.0;
  double completeness_cm = 0.0;
  double chamfer_l1_cm = 0.0;
  double f_score_percent = 0.0;
};

struct BenchResult {
  std::string sequence;
  ExitCode exit_code = kExitOk;  ///< of the run
  std::optional<double> ate_rmse_m;
  std::optional<BenchMapResult> map;
  std::string map_note;              ///< why there is no `map`
  ExitCode map_exit_code = kExitOk;  ///< of judging it, where the true surface is there
  std::int64_t first_scans = -1;     ///< if only so many were to be tracked
  double scans_per_s = 0.0;          ///< of the whole run, the mapper's last work included
  std::int64_t gaussians = 0;
  double map_mb = 0.0;  ///< of map.ply, 1e6 bytes
};

/// Runs as `covsplat run` does and reads what it wrote. The caller holds an InterruptGuard.
BenchResult BenchSequence(const DataSequence& sequence, const BenchRequest& request);

/// What the folder of a finished run says; without `map`.
Result<BenchResult> ReadBenchResult(const std::filesystem::path& run);

/// What `covsplat eval map --json` printed.
Result<BenchMapResult> ReadBenchMapResult(const std::filesystem::path& file);

/// The true poses of the LiDAR, from those that the data set gives.
Result<Trajectory> LoadLidarTruth(const DataSequence& sequence);

}  // namespace covsplat
