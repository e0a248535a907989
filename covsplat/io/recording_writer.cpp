#include "covsplat/io/recording_writer.hpp"

#include <array>
#include <string>
#include <system_error>
#include <vector>

#include "covsplat/core/check.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMarker = ".covsplat_recording";

struct NumberedFiles {
  const char* folder;
  const char* extension;
};
constexpr std::array kNumberedFiles = {NumberedFiles{"velodyne", ".bin"},
                                       NumberedFiles{"timestamps", ".bin"},
                                       NumberedFiles{"labels", ".label"}};
constexpr std::array kSingleFiles = {"gt_tum.txt", "gt_mesh.ply", "sensor.yaml"};

std::string NumberedName(std::int64_t index, const char* extension) {
  return fmt::format("{:06}{}", index, extension);
}

// Removes what this class wrote and does not open anew. Its scans are numbered without a gap, and
// so are those that are left when this is interrupted.
void RemoveOldRecording(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : kSingleFiles) fs::remove(folder / name, ignored);
  for (const NumberedFiles& files : kNumberedFiles) {
    const auto file = [&](std::int64_t index) {
      return folder / files.folder / NumberedName(index, files.extension);
    };
    std::int64_t count = 0;
    while (fs::exists(file(count), ignored)) ++count;
    while (count > 0 && fs::remove(file(count - 1), ignored)) --count;
  }
}

Result<void> PrepareFolder(const fs::path& folder, bool overwrite) {
  std::error_code error;
  fs::create_directories(folder, error);
  const bool empty = !error && fs::is_empty(folder, error);
  if (!error && !empty && !overwrite) {
    return Fail(ErrorCode::kOutput,
                "{}: is not empty; choose another folder, or allow to overwrite",
                folder.string());
  }
  if (!error && fs::exists(folder / kMarker, error)) RemoveOldRecording(folder);
  for (const auto& [name, extension] : kNumberedFiles) {
    if (!error) fs::create_directories(folder / name, error);
    if (!error && !fs::is_empty(folder / name, error)) {
      return Fail(ErrorCode::kOutput,
                  "{}: holds files that were not written here; choose another folder",
                  (folder / name).string());
    }
  }
  if (error) {
    return Fail(ErrorCode::kOutput, "{}: cannot be written: {}", folder.string(), error.message());
  }
  return WriteFileAtomically(folder / kMarker, "written by covsplat\n");
}

// Not synced to the storage file by file: that takes longer than writing them.
Result<void> WriteBinary(const fs::path& path, std::string_view bytes) {
  Result<AppendFile> file = AppendFile::Open(path);
  if (!file) return Forward(file);
  return file->Append(bytes).and_then([&] { return file->Close(); });
}

template <class T>
std::string_view BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::vector<float> Records(const Scan& scan) {
  std::vector<float> records;
  records.reserve(4 * scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3f& point = scan.points[i];
    records.insert(records.end(), {point.x(), point.y(), point.z()});
    records.push_back(scan.intensity.empty() ? 0.0f : scan.intensity[i]);
  }
  return records;
}

}  // namespace

Result<RecordingWriter> RecordingWriter::Create(const fs::path& folder, bool overwrite) {
  const Result<void> prepared = PrepareFolder(folder, overwrite);
  if (!prepared) return Forward(prepared);
  Result<AppendFile> times = AppendFile::Open(folder / "times.txt");
  if (!times) return Forward(times);
  Result<AppendFile> poses = AppendFile::Open(folder / "poses.txt");
  if (!poses) return Forward(poses);
  return RecordingWriter(folder, std::move(*times), std::move(*poses));
}

Result<void> RecordingWriter::Write(const Scan& scan, const SE3& T_world_sensor) {
  COVSPLAT_CHECK(scan.intensity.empty() || scan.intensity.size() == scan.points.size());
  const std::int64_t index = count_++;
  const fs::path file = folder_ / "velodyne" / NumberedName(index, ".bin");
  return WriteBinary(file, BytesOf(Records(scan)))
      .and_then([&] {
        const std::vector<float>& times = scan.time_offset_s;
        return WriteColumn(times_of_points_, scan, index, times.size(), BytesOf(times));
      })
      .and_then(
          [&] { return WriteColumn(labels_, scan, index, scan.label.size(), BytesOf(scan.label)); })
      .and_then([&] { return poses_.Append(KittiLine(T_world_sensor)); })
      .and_then([&] { return times_.Append(fmt::format("{:.9f}\n", scan.stamp_s)); });
}

Result<void> RecordingWriter::WriteColumn(Column& column,
                                          const Scan& scan,
                                          std::int64_t index,
                                          std::size_t values,
                                          std::string_view bytes) {
  COVSPLAT_CHECK(values == 0 || values == scan.points.size());
  const bool first_with_points = !column.present && !scan.points.empty();
  if (!scan.points.empty()) {
    COVSPLAT_CHECK(column.present.value_or(values > 0) == (values > 0));
    column.present = values > 0;
  }
  if (!column.present.value_or(false)) return {};
  const auto path = [&](std::int64_t scan_index) {
    return folder_ / column.folder / NumberedName(scan_index, column.extension);
  };
  // Scans without points that came before any with points have no values either.
  for (std::int64_t i = first_with_points ? 0 : index; i < index; ++i) {
    Result<void> none = WriteBinary(path(i), "");
    if (!none) return none;
  }
  return WriteBinary(path(index), bytes);
}

Result<void> RecordingWriter::WriteMesh(const TriangleMesh& mesh) {
  return WriteTriangleMesh(folder_ / "gt_mesh.ply", mesh);
}

Result<void> RecordingWriter::WriteSensor(std::string_view yaml) {
  return WriteFileAtomically(folder_ / "sensor.yaml", yaml);
}

Result<void> RecordingWriter::Finish(const Trajectory& dense_truth) {
  Result<void> truth = WriteTum(folder_ / "gt_tum.txt", dense_truth);
  if (!truth) return truth;
  return times_.Close().and_then([&] { return poses_.Close(); });
}

}  // namespace covsplat
