#include "covsplat/io/scan_source.hpp"

#include <algorithm>
#include <numbers>
#include <utility>
#include <vector>

#include "covsplat/io/kitti_scan.hpp"
#include "covsplat/io/name_stamp.hpp"
#include "covsplat/io/pcd.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/io/table_scan.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// A folder with one file per scan.
class FolderSource : public ScanSource {
 public:
  FolderSource(RecordingLayout layout, std::vector<double> stamps_s, const SourceOptions& options)
      : layout_(std::move(layout)), stamps_s_(std::move(stamps_s)), options_(options) {
    const auto files = static_cast<std::int64_t>(layout_.files.size());
    next_ = options_.first_scan;
    const std::int64_t left = files - options_.first_scan;
    count_ = options_.max_scans < 0 ? left : std::min(left, options_.max_scans);
    end_ = next_ + count_;
  }

  Result<std::optional<Scan>> Next() override {
    if (next_ == end_) return std::optional<Scan>();
    const std::int64_t index = next_++;
    Result<TableScan> read = ReadFileOf(static_cast<std::size_t>(index));
    if (!read) return Forward(read);
    read->scan.index = index;
    if (!read->stamp_from_points) read->scan.stamp_s = StampOf(index);
    return std::optional<Scan>(std::move(read->scan));
  }

  std::int64_t ScanCount() const override { return count_; }
  std::string Description() const override;

 private:
  double StampOf(std::int64_t index) const {
    if (!stamps_s_.empty()) return stamps_s_[static_cast<std::size_t>(index)];
    return static_cast<double>(index) * options_.scan_period_s;
  }
  Result<TableScan> ReadFileOf(std::size_t index) const;
  Result<TableScan> ReadKitti(const std::filesystem::path& file) const;

  RecordingLayout layout_;
  std::vector<double> stamps_s_;  // of all scans, or empty
  SourceOptions options_;
  std::int64_t next_ = 0;
  std::int64_t end_ = 0;
  std::int64_t count_ = 0;
};

Result<TableScan> FolderSource::ReadFileOf(std::size_t index) const {
  const std::filesystem::path& file = layout_.files[index];
  if (layout_.format == ScanFormat::kKitti) return ReadKitti(file);
  const bool is_pcd = layout_.format == ScanFormat::kPcd;
  const Result<PointTable> table = is_pcd ? ReadPcd(file) : ReadPly(file);
  if (!table) return Forward(table);
  return ScanFromTable(*table, file.string());
}

Result<TableScan> FolderSource::ReadKitti(const std::filesystem::path& file) const {
  Result<Scan> scan = ReadKittiScan(file);
  if (!scan) return Forward(scan);
  if (!layout_.point_time_folder.empty()) {
    auto times = ReadPointTimes(layout_.point_time_folder / file.filename(), scan->points.size());
    if (!times) return Forward(times);
    scan->time_offset_s = std::move(*times);
  }
  RaiseElevation(scan->points, options_.kitti_elevation_correction_deg * kRadPerDeg);
  return TableScan{std::move(*scan), false};
}

std::string FolderSource::Description() const {
  const bool is_kitti = layout_.format == ScanFormat::kKitti;
  const std::string_view kind = is_kitti                             ? "KITTI"
                                : layout_.format == ScanFormat::kPcd ? "PCD"
                                                                     : "PLY";
  const std::string_view point_times = !is_kitti ? "time per point where the files have one"
                                       : layout_.point_time_folder.empty() ? "no time per point"
                                                                           : "with time per point";
  const std::string stamps =
      stamps_s_.empty()
          ? fmt::format("one scan every {} s", options_.scan_period_s)
          : std::string(layout_.stamp_file.empty() ? "with times for names" : "with times.txt");
  return fmt::format("{} folder, {} scans, {}, {}", kind, count_, stamps, point_times);
}

/// For a part of a recording beside the times of the whole: the times by the numbers that the files
/// have for names, or nothing if they do not tell.
std::vector<double> StampsByNumber(const std::vector<std::filesystem::path>& files,
                                   const std::vector<double>& stamps) {
  std::vector<double> chosen;
  for (const std::filesystem::path& file : files) {
    const auto number = ParseInteger(file.stem().string());
    if (!number || *number < 0 || *number >= static_cast<std::int64_t>(stamps.size())) return {};
    chosen.push_back(stamps[static_cast<std::size_t>(*number)]);
  }
  return chosen;
}

Result<std::vector<double>> StampsOf(const RecordingLayout& layout) {
  if (layout.stamp_file.empty()) return StampsOfNames(layout.files);
  Result<std::vector<double>> stamps = ReadStamps(layout.stamp_file);
  if (!stamps || stamps->size() == layout.files.size()) return stamps;
  std::vector<double> chosen;
  if (stamps->size() > layout.files.size()) chosen = StampsByNumber(layout.files, *stamps);
  if (!chosen.empty()) return chosen;
  return Fail(
      ErrorCode::kInput,
      "{}: has {} lines for {} scans; it needs one time per scan (of a part of a recording, "
      "the files' names must be their numbers in the whole), or remove it to have scans at "
      "even times",
      layout.stamp_file.string(),
      stamps->size(),
      layout.files.size());
}

}  // namespace

Result<std::unique_ptr<ScanSource>> OpenScanSource(const std::filesystem::path& folder,
                                                   const SourceOptions& options) {
  Result<RecordingLayout> layout = InspectRecording(folder, options.format);
  if (!layout) return Forward(layout);
  const auto files = static_cast<std::int64_t>(layout->files.size());
  if (options.first_scan < 0 || options.first_scan >= files) {
    return Fail(ErrorCode::kUsage,
                "{}: has {} scans, so the first cannot be number {}",
                folder.string(),
                files,
                options.first_scan);
  }
  Result<std::vector<double>> stamps = StampsOf(*layout);
  if (!stamps) return Forward(stamps);
  return std::make_unique<FolderSource>(std::move(*layout), std::move(*stamps), options);
}

}  // namespace covsplat
