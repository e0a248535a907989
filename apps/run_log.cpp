#include "apps/run_log.hpp"

#include <array>

#include <fmt/format.h>

#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

/// Of the tracker ("wait": for the mapper), then in lockstep those of the mapper.
constexpr std::array kStages = {"preprocess",
                                "align",
                                "deskew",
                                "wait",
                                "keyframe",
                                "reliability",
                                "insert",
                                "manage",
                                "optimize",
                                "target"};

std::string Header() {
  std::string line =
      "scan,stamp_s,state,keyframe,points,not_finite,out_of_range,has_time,source_points,"
      "correspondences,inlier_ratio,overlap,support,rms_residual_m,iterations,degenerate_"
      "directions,"
      "gaussians,target_surfels,mapper_steps,rss_bytes,track_ms";
  for (const char* stage : kStages) line += fmt::format(",{}_ms", stage);
  return line + "\n";
}

std::string Row(const ScanRecord& r, std::int64_t rss_bytes) {
  std::string line = fmt::format("{},{:.9f},{},{:d},{},{},{},{:d},",
                                 r.scan,
                                 r.stamp_s,
                                 NameOf(r.state),
                                 r.is_keyframe,
                                 r.points,
                                 r.not_finite,
                                 r.out_of_range,
                                 r.has_time);
  line += fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.5f},{},{},{},{},{},{},{:.3f}",
                      r.source_points,
                      r.correspondences,
                      r.inlier_ratio,
                      r.overlap,
                      r.support,
                      r.rms_residual_m,
                      r.iterations,
                      r.degenerate_directions,
                      r.gaussians,
                      r.target_surfels,
                      r.mapper_steps,
                      rss_bytes,
                      r.track_ms);
  for (const char* stage : kStages) line += fmt::format(",{:.3f}", r.times.Of(stage));
  return line + "\n";
}

}  // namespace

std::string_view NameOf(TrackState state) {
  switch (state) {
    case TrackState::kInitializing:
      return "initializing";
    case TrackState::kTracking:
      return "tracking";
    case TrackState::kLost:
      return "lost";
  }
  return "unknown";
}

Result<RunLog> RunLog::Open(const std::filesystem::path& folder, const ScanSelection& scans) {
  Result<AppendFile> tum = AppendFile::Open(folder / "trajectory_tum.txt");
  if (!tum) return Forward(tum);
  Result<AppendFile> kitti = AppendFile::Open(folder / "trajectory_kitti.txt");
  if (!kitti) return Forward(kitti);
  Result<AppendFile> frames = AppendFile::Open(folder / "frames.csv");
  if (!frames) return Forward(frames);
  if (const Result<void> begun = frames->Append(Header()); !begun) return Forward(begun);
  return RunLog(scans, std::move(*tum), std::move(*kitti), std::move(*frames));
}

Result<void> RunLog::Append(const ScanRecord& record, std::int64_t rss_bytes) {
  const TimedPose pose = {record.stamp_s, record.T_map_sensor};
  const std::int64_t row = (record.scan - scans_.first) / scans_.jump;
  return FillGap(row - rows_, pose)
      .and_then([&] { return tum_.Append(TumLine(pose)); })
      .and_then([&] { return kitti_.Append(KittiLine(pose.T_world_sensor)); })
      .and_then([&] { return frames_.Append(Row(record, rss_bytes)); })
      .map([&] {
        rows_ = row + 1;
        last_ = pose;
      });
}

// In one piece, so that a killed run does not end in the middle of a gap.
Result<void> RunLog::FillGap(std::int64_t rows, const TimedPose& next) {
  if (rows <= 0) return {};
  std::string tum;
  std::string kitti;
  for (std::int64_t i = 1; i <= rows; ++i) {
    TimedPose pose = next;
    if (last_) {
      const double share = static_cast<double>(i) / static_cast<double>(rows + 1);
      pose.stamp_s = last_->stamp_s + share * (next.stamp_s - last_->stamp_s);
      pose.T_world_sensor = Interpolate(last_->T_world_sensor, next.T_world_sensor, share);
      tum += TumLine(pose);
    }
    kitti += KittiLine(pose.T_world_sensor);
  }
  return tum_.Append(tum).and_then([&] { return kitti_.Append(kitti); });
}

Result<void> RunLog::FillTo(std::int64_t count) {
  if (!last_) return {};
  std::string kitti;
  for (; rows_ < count; ++rows_) kitti += KittiLine(last_->T_world_sensor);
  return kitti_.Append(kitti);
}

Result<void> RunLog::Close() {
  return tum_.Close().and_then([&] { return kitti_.Close(); }).and_then([&] {
    return frames_.Close();
  });
}

}  // namespace covsplat
