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
                                "loops",
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
      "gaussians,target_surfels,mapper_steps,rss_bytes,latency_ms,track_ms";
  for (const char* stage : kStages) line += fmt::format(",{}_ms", stage);
  return line + "\n";
}

std::string Row(const ScanRecord& r, const ScanCost& cost) {
  std::string line = fmt::format("{},{:.9f},{},{:d},{},{},{},{:d},",
                                 r.scan,
                                 r.stamp_s,
                                 NameOf(r.state),
                                 r.is_keyframe,
                                 r.points,
                                 r.not_finite,
                                 r.out_of_range,
                                 r.has_time);
  line += fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.5f},{},{},{},{},{},{},{:.3f},{:.3f}",
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
                      cost.rss_bytes,
                      cost.latency_ms,
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

PoseRows::Text PoseRows::Next(const ScanRecord& record) {
  const TimedPose next = {record.stamp_s, record.T_map_sensor};
  const std::int64_t row = (record.scan - scans_.first) / scans_.jump;
  const std::int64_t left_out = row - rows_;
  Text text;
  for (std::int64_t i = 1; i <= left_out; ++i) {
    TimedPose pose = next;
    if (last_) {
      const double share = static_cast<double>(i) / static_cast<double>(left_out + 1);
      pose.stamp_s = last_->stamp_s + share * (next.stamp_s - last_->stamp_s);
      pose.T_world_sensor = Interpolate(last_->T_world_sensor, next.T_world_sensor, share);
      text.tum += TumLine(pose);
    }
    text.kitti += KittiLine(pose.T_world_sensor);
  }
  text.tum += TumLine(next);
  text.kitti += KittiLine(next.T_world_sensor);
  rows_ = row + 1;
  last_ = next;
  return text;
}

PoseRows::Text PoseRows::FillTo(std::int64_t count) {
  Text text;
  if (!last_) return text;
  for (; rows_ < count; ++rows_) text.kitti += KittiLine(last_->T_world_sensor);
  return text;
}

Result<void> RunLog::Append(const ScanRecord& record, const ScanCost& cost) {
  return AppendPoses(rows_.Next(record)).and_then([&] {
    return frames_.Append(Row(record, cost));
  });
}

Result<void> RunLog::FillTo(std::int64_t count) { return AppendPoses(rows_.FillTo(count)); }

// In one piece, so that a killed run does not end in the middle of a gap.
Result<void> RunLog::AppendPoses(const PoseRows::Text& rows) {
  return tum_.Append(rows.tum).and_then([&] { return kitti_.Append(rows.kitti); });
}

Result<void> RunLog::Close() {
  return tum_.Close().and_then([&] { return kitti_.Close(); }).and_then([&] {
    return frames_.Close();
  });
}

Result<void> RewritePoses(const std::filesystem::path& folder,
                          const ScanSelection& scans,
                          std::span<const ScanRecord> records,
                          std::int64_t count) {
  PoseRows rows(scans);
  PoseRows::Text all;
  const auto add = [&](const PoseRows::Text& text) {
    all.tum += text.tum;
    all.kitti += text.kitti;
  };
  for (const ScanRecord& record : records) add(rows.Next(record));
  add(rows.FillTo(count));
  return WriteFileAtomically(folder / "trajectory_tum.txt", all.tum).and_then([&] {
    return WriteFileAtomically(folder / "trajectory_kitti.txt", all.kitti);
  });
}

}  // namespace covsplat
