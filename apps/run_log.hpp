// The files of a run that grow scan by scan; a killed run loses none of what was written.
#pragma once

#include <filesystem>

#include "covsplat/io/output_file.hpp"
#include "covsplat/slam/slam_system.hpp"

namespace covsplat {

/// trajectory_tum.txt, trajectory_kitti.txt and frames.csv.
class RunLog {
 public:
  static Result<RunLog> Open(const std::filesystem::path& folder);

  Result<void> Append(const ScanRecord& record, std::int64_t rss_bytes);
  Result<void> Close();

 private:
  RunLog(AppendFile tum, AppendFile kitti, AppendFile frames)
      : tum_(std::move(tum)), kitti_(std::move(kitti)), frames_(std::move(frames)) {}

  AppendFile tum_;
  AppendFile kitti_;
  AppendFile frames_;
};

/// "initializing", "tracking" or "lost".
std::string_view NameOf(TrackState state);

}  // namespace covsplat
