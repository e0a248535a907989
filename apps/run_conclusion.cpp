#include "apps/run_conclusion.hpp"

#include <utility>

#include "apps/keyframe_log.hpp"
#include "apps/run_pictures.hpp"
#include "apps/run_report.hpp"
#include <fmt/format.h>

#include "covsplat/io/output_file.hpp"
#include "covsplat/io/trajectory_file.hpp"
#include "covsplat/mapping/map_ply.hpp"
#include "covsplat/report/report.hpp"

namespace covsplat {
namespace {

/// Held-out scans against the map as it is, and as its Gaussians were spawned.
Result<void> MeasureMap(SlamSystem& system, const SlamConfig& config, RunResults& results) {
  ThreadPool pool(config.system.threads);
  const GaussianMap& map = system.GetMapper().Map();
  auto spawned = CopyEngine(
      map, map.AsSpawned(), config.system.backend, system.Sensor(), config.mapper.engine, pool);
  if (!spawned) return Forward(spawned);
  for (const HeldOut& scan : system.HeldOuts()) {
    const SE3 T_map_sensor = system.PoseOf(scan.scan);
    RenderOutput before = (*spawned)->Render(T_map_sensor);
    RenderOutput after = system.GetMapper().Render(T_map_sensor);
    HeldOutResult result;
    result.scan = scan.scan;
    result.before = MeasureHeldOut(scan.range_m, before.range_m);
    result.after = MeasureHeldOut(scan.range_m, after.range_m);
    result.measured_m = scan.range_m;
    result.rendered_m = std::move(after.range_m);
    results.held_out.push_back(std::move(result));
  }
  return {};
}

void Evaluate(RunResults& results) {
  if (!results.truth) return;
  TrajectoryError error = EvaluateTrajectory(TrajectoryOf(results), results.truth->trajectory);
  if (error.matched > 0) {
    results.error = std::move(error);
    return;
  }
  results.problems.push_back(
      {-1, fmt::format("{}: has no pose at the time of any scan", results.truth->path.string())});
}

/// Where the Gaussians' keyframes are, in the order of their numbers.
Trajectory KeyframesOf(const SlamSystem& system, const RunResults& results) {
  const GaussianMap& map = system.GetMapper().Map();
  Trajectory keyframes;
  for (int k = 0; k < map.Keyframes(); ++k) {
    const std::int64_t scan = system.KeyframeScans()[static_cast<std::size_t>(k)];
    const double stamp_s = results.records[RecordOf(results, scan)].stamp_s;
    keyframes.push_back({stamp_s, map.KeyframePose(k)});
  }
  return keyframes;
}

}  // namespace

Result<void> ConcludeRun(SlamSystem& system,
                         const AppConfig& config,
                         const std::string& config_yaml,
                         const std::filesystem::path& folder,
                         RunResults& results) {
  const GaussianMap& map = system.GetMapper().Map();
  results.gaussians = map.Size();
  results.keyframes = static_cast<std::size_t>(map.Keyframes());
  results.mapper_steps = system.GetMapper().Steps();
  results.mapper_times = system.MapperTimes();
  results.training = system.GetMapper().Views().Training();
  results.map_memory = system.MemoryOfMap();
  const SavedMap saved = FlattenMap(map);
  Result<void> written = WriteMapPly(folder / "map.ply", saved);
  std::error_code ignored;
  if (written) {
    results.map_bytes =
        static_cast<double>(std::filesystem::file_size(folder / "map.ply", ignored));
  }
  const auto keyframes =
      WriteTum(folder / "keyframes_tum.txt", KeyframesOf(std::as_const(system), results));
  if (written) written = keyframes;
  const auto training = WriteKeyframes(folder, results.training, system.KeyframeScans());
  if (written) written = training;
  Evaluate(results);
  const Result<void> measured = MeasureMap(system, config.slam, results);
  if (written) written = measured;
  results.pictures = DrawMap(system, config.slam, saved, results);

  const auto metrics = WriteFileAtomically(folder / "metrics.json", MetricsJson(results));
  if (written) written = metrics;
  const std::string html = MakeReport(ReportOf(system, config_yaml, results));
  const auto report = WriteFileAtomically(folder / "report.html", html);
  return written ? report : written;
}

}  // namespace covsplat
