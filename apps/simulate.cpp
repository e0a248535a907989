#include "apps/simulate.hpp"

#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/interrupt.hpp"
#include "apps/progress.hpp"
#include "apps/simulate_preview.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>

#include "covsplat/core/sensor_presets.hpp"
#include "covsplat/io/output_file.hpp"
#include "covsplat/io/recording_writer.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

constexpr double kTruthHz = 100.0;

// The section `sensor` of a run's configuration.
std::string SensorYaml(const SimulatedLidarConfig& lidar) {
  std::string yaml =
      "# The sensor that made this recording: covsplat run RECORDING -c sensor.yaml\n";
  yaml += "sensor:\n";
  if (lidar.kind == LidarKind::kSpinning) {
    const SensorModel model = ModelOf(lidar);
    std::vector<double> elevation_deg;
    for (const double e : model.Elevations()) {
      elevation_deg.push_back(std::round(e * 180.0 / std::numbers::pi * 1e9) * 1e-9);
    }
    yaml += fmt::format("  elevation_deg: [{:.9g}]\n", fmt::join(elevation_deg, ", "));
    yaml += fmt::format("  columns: {}\n", lidar.columns);
  }
  yaml +=
      fmt::format("  min_range_m: {}\n  max_range_m: {}\n", lidar.min_range_m, lidar.max_range_m);
  return yaml;
}

// The surfaces and the sensor do not depend on how many scans follow.
Result<void> WriteWorld(const Simulation& simulation, RecordingWriter& writer) {
  return writer.WriteMesh(simulation.StaticWorld().Mesh()).and_then([&] {
    return writer.WriteSensor(SensorYaml(simulation.Config().lidar));
  });
}

// The truth from just before the first scan to just after the last one that was written.
Trajectory TruthOf(const Simulation& simulation, int scans) {
  Trajectory truth = simulation.Truth(kTruthHz);
  if (scans == simulation.ScanCount()) return truth;
  const SimulatedLidarConfig& lidar = simulation.Config().lidar;
  const double end_s = StampOf(lidar, scans);
  std::erase_if(truth, [&](const TimedPose& pose) { return pose.stamp_s >= end_s; });
  return truth;
}

struct Written {
  int scans = 0;
  std::size_t points = 0;
};

// Number of scans and points written.
Result<Written> WriteScans(const Simulation& simulation, RecordingWriter& writer, bool quiet) {
  ThreadPool pool(CpuCount());
  Progress::Options options;
  options.quiet = quiet;
  Progress progress(options);
  Written total;
  for (int i = 0; i < simulation.ScanCount() && !Interrupted(); ++i) {
    const auto start = std::chrono::steady_clock::now();
    const Scan scan = simulation.MakeScan(i, pool);
    const Result<void> written = writer.Write(scan, simulation.PoseOf(i));
    if (!written) return Forward(written);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    total.points += scan.points.size();
    total.scans = i + 1;
    ProgressStatus status;
    status.done = total.scans;
    status.total = simulation.ScanCount();
    status.ms_per_scan = took.count();
    status.gaussians = -1;
    status.rss_bytes = ReadMemoryUse().rss_bytes;
    progress.Update(status);
  }
  return total;
}

std::string Describe(const SimulatedLidarConfig& lidar) {
  if (lidar.kind == LidarKind::kRosette) {
    return fmt::format("{:.0f} points/s in a rosette", lidar.rosette.points_per_s);
  }
  return fmt::format("{} x {} pixels", lidar.rows, lidar.columns);
}

}  // namespace

Result<SimulationConfig> ResolveSimulation(const ConfigOptions& options,
                                           const std::string& sensor) {
  const Result<SimulationConfig> named = ResolveConfig<SimulationConfig>(options);
  if (!named) return named;
  const std::string& name = sensor.empty() ? named->sensor : sensor;
  if (name.empty()) return named;
  const Result<SensorPreset> preset = FindSensorPreset(name);
  if (!preset) return Forward(preset);
  SimulationConfig start;
  start.lidar = LidarConfigOf(*preset);
  Result<SimulationConfig> config = ResolveConfig<SimulationConfig>(options, start);
  if (config) config->sensor = name;
  return config;
}

ExitCode Simulate(const SimulateRequest& request) {
  const Result<Simulation> simulation = Simulation::Create(request.config);
  if (!simulation) return ReportError(simulation.error());
  Result<RecordingWriter> writer = RecordingWriter::Create(request.folder, request.overwrite);
  if (!writer) return ReportError(writer.error());
  for (const std::string& doubt : simulation->Warnings()) ReportWarning(doubt);
  const Result<void> world = WriteWorld(*simulation, *writer);
  if (!world) return ReportError(world.error());
  const Result<Written> written = WriteScans(*simulation, *writer, request.quiet);
  if (!written) return ReportError(written.error());
  const Result<void> finished = writer->Finish(TruthOf(*simulation, written->scans));
  if (!finished) return ReportError(finished.error());
  if (written->scans > 0 && written->points == 0) {
    ReportWarning("no ray met a surface: the sensor never came near one");
  }
  if (!request.quiet) {
    fmt::print("simulated   {}: {} scans of {}, {}\n",
               request.folder.string(),
               written->scans,
               request.config.world,
               Describe(request.config.lidar));
    std::fflush(stdout);
  }
  return Interrupted() ? kExitInterrupted : kExitOk;
}

ExitCode Preview(const SimulationConfig& config, const std::filesystem::path& file, double share) {
  const Result<Simulation> simulation = Simulation::Create(config);
  if (!simulation) return ReportError(simulation.error());
  ThreadPool pool(CpuCount());
  const double time_s = share * simulation->SensorMotion().Duration();
  const auto png = PreviewPng(*simulation, time_s, pool);
  if (!png) return ReportError(png.error());
  const Result<void> written =
      WriteFileAtomically(file, {reinterpret_cast<const char*>(png->data()), png->size()});
  return written ? kExitOk : ReportError(written.error());
}

}  // namespace covsplat
