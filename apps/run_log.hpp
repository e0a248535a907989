// The files of a run that grow scan by scan; a killed run loses none of what was written.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "covsplat/io/output_file.hpp"
#include "covsplat/slam/slam_system.hpp"

namespace covsplat {

/// Which scans of a recording a run takes: `first`, `first + jump`, ...
struct ScanSelection {
  std::int64_t first = 0;
  std::int64_t jump = 1;
};

/// What a scan took beside what its record tells.
struct ScanCost {
  double latency_ms = 0.0;     ///< scan in to pose out: from its arrival, so with what it waited
  std::int64_t rss_bytes = 0;  ///< the process's, when the scan was done
};

/// The rows of both trajectory files. Scans that were left out (damaged, out of order, dropped) get
/// poses too, or the rows of KITTI, which have no times, would not tell which scan they are of:
/// between their neighbours they are interpolated; before the first and after the last tracked
/// scan, where their times are not known, they repeat its pose in the KITTI file and have no row in
/// the TUM file.
class PoseRows {
 public:
  struct Text {
    std::string tum;
    std::string kitti;
  };

  explicit PoseRows(const ScanSelection& scans) : scans_(scans) {}

  /// Of the next tracked scan and of what was left out before it.
  Text Next(const ScanRecord& record);
  /// After the last one; `count` scans were selected in all.
  Text FillTo(std::int64_t count);

 private:
  ScanSelection scans_;
  std::int64_t rows_ = 0;  ///< of the KITTI file
  std::optional<TimedPose> last_;
};

/// trajectory_tum.txt, trajectory_kitti.txt and frames.csv, which has the tracked scans alone.
class RunLog {
 public:
  static Result<RunLog> Open(const std::filesystem::path& folder, const ScanSelection& scans);

  Result<void> Append(const ScanRecord& record, const ScanCost& cost);
  /// After the last scan; `count` scans were selected in all.
  Result<void> FillTo(std::int64_t count);
  Result<void> Close();

 private:
  RunLog(const ScanSelection& scans, AppendFile tum, AppendFile kitti, AppendFile frames)
      : rows_(scans), tum_(std::move(tum)), kitti_(std::move(kitti)), frames_(std::move(frames)) {}
  Result<void> AppendPoses(const PoseRows::Text& rows);

  PoseRows rows_;
  AppendFile tum_;
  AppendFile kitti_;
  AppendFile frames_;
};

/// Writes the trajectory files of a run anew, each at once.
Result<void> RewritePoses(const std::filesystem::path& folder,
                          const ScanSelection& scans,
                          std::span<const ScanRecord> records,
                          std::int64_t count);

/// "initializing", "tracking" or "lost".
std::string_view NameOf(TrackState state);

}  // namespace covsplat
