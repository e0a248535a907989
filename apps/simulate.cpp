#include "apps/simulate.hpp"

#include <chrono>

#include "apps/interrupt.hpp"
#include "apps/progress.hpp"
#include "apps/system_info.hpp"
#include <fmt/format.h>

#include "covsplat/io/recording_writer.hpp"
#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

constexpr double kTruthHz = 100.0;

/// The truth from just before the first scan to just after the last one that was written.
Trajectory TruthOf(const Simulation& simulation, int scans) {
  Trajectory truth = simulation.Truth(kTruthHz);
  if (scans == simulation.ScanCount()) return truth;
  const SimulatedLidarConfig& lidar = simulation.Config().lidar;
  const double end_s = StampOf(lidar, scans);
  std::erase_if(truth, [&](const TimedPose& pose) { return pose.stamp_s >= end_s; });
  return truth;
}

/// Number of scans written.
Result<int> WriteScans(const Simulation& simulation, RecordingWriter& writer, bool quiet) {
  ThreadPool pool(CpuCount());
  Progress::Options options;
  options.quiet = quiet;
  Progress progress(options);
  int i = 0;
  for (; i < simulation.ScanCount() && !Interrupted(); ++i) {
    const auto start = std::chrono::steady_clock::now();
    const Result<void> written = writer.Write(simulation.MakeScan(i, pool), simulation.PoseOf(i));
    if (!written) return Forward(written);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    ProgressStatus status;
    status.done = i + 1;
    status.total = simulation.ScanCount();
    status.ms_per_scan = took.count();
    status.gaussians = -1;
    status.rss_bytes = ReadMemoryUse().rss_bytes;
    progress.Update(status);
  }
  return i;
}

}  // namespace

ExitCode Simulate(const SimulateRequest& request) {
  const Result<Simulation> simulation = Simulation::Create(request.config);
  if (!simulation) return ReportError(simulation.error());
  Result<RecordingWriter> writer = RecordingWriter::Create(request.folder, request.overwrite);
  if (!writer) return ReportError(writer.error());
  const Result<int> scans = WriteScans(*simulation, *writer, request.quiet);
  if (!scans) return ReportError(scans.error());
  const Result<void> finished = writer->Finish(TruthOf(*simulation, *scans));
  if (!finished) return ReportError(finished.error());
  if (!request.quiet) {
    fmt::print("simulated   {}: {} scans of the {}, {} x {} pixels\n",
               request.folder.string(),
               *scans,
               request.config.world,
               request.config.lidar.rows,
               request.config.lidar.columns);
    std::fflush(stdout);
  }
  return Interrupted() ? kExitInterrupted : kExitOk;
}

}  // namespace covsplat
