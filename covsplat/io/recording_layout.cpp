#include "covsplat/io/recording_layout.hpp"

#include <algorithm>
#include <cctype>
#include <string>
#include <system_error>

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kRemedy =
    "give the folder that holds the scans: velodyne/*.bin, velodyne_points/data/*.bin or *.bin "
    "(KITTI: float32 x y z "
    "intensity), *.pcd or *.ply";

bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// Cuts the number off the front of a name, without leading zeros.
std::string_view TakeNumber(std::string_view& name) {
  std::size_t end = 0;
  while (end < name.size() && IsDigit(name[end])) ++end;
  std::string_view number = name.substr(0, end);
  name.remove_prefix(end);
  while (number.size() > 1 && number.front() == '0') number.remove_prefix(1);
  return number;
}

ScanFormat FormatOf(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".bin") return ScanFormat::kKitti;
  if (extension == ".pcd") return ScanFormat::kPcd;
  if (extension == ".ply") return ScanFormat::kPly;
  return ScanFormat::kAuto;
}

Result<void> CheckFolder(const fs::path& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (!fs::exists(status)) {
    return Fail(ErrorCode::kInput, "{}: does not exist; {}", folder.string(), kRemedy);
  }
  if (!fs::is_directory(status)) {
    return Fail(ErrorCode::kInput, "{}: is not a folder; {}", folder.string(), kRemedy);
  }
  return {};
}

// The scan files of a folder, hidden ones left out.
Result<std::vector<fs::path>> ListScanFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const bool hidden = entry->path().filename().string().starts_with('.');
    std::error_code ignored;
    if (hidden || entry->is_directory(ignored)) continue;
    if (FormatOf(entry->path()) != ScanFormat::kAuto) files.push_back(entry->path());
  }
  if (error) {
    return Fail(ErrorCode::kInput, "{}: cannot be read: {}", folder.string(), error.message());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.filename().string(), b.filename().string());
  });
  return files;
}

// The one format of all files, or the wanted one.
Result<ScanFormat> ChooseFormat(const std::vector<fs::path>& files,
                                ScanFormat wanted,
                                const fs::path& folder) {
  if (wanted != ScanFormat::kAuto) return wanted;
  for (const fs::path& file : files) {
    if (FormatOf(file) == FormatOf(files.front())) continue;
    return Fail(ErrorCode::kInput,
                "{}: holds scans of several kinds, such as {} and {}; choose one with "
                "--format kitti, pcd or ply",
                folder.string(),
                files.front().filename().string(),
                file.filename().string());
  }
  return FormatOf(files.front());
}

fs::path IfExists(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored) ? path : fs::path();
}

fs::path IfHoldsFiles(const fs::path& folder) {
  std::error_code error;
  const bool empty = fs::is_empty(folder, error);
  return error || empty ? fs::path() : folder;
}

}  // namespace

bool NaturalLess(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a;
  const std::string_view whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (IsDigit(a.front()) && IsDigit(b.front())) {
      const std::string_view number_a = TakeNumber(a);
      const std::string_view number_b = TakeNumber(b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
    } else {
      if (a.front() != b.front()) return a.front() < b.front();
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  if (a.empty() != b.empty()) return a.empty();
  return whole_a < whole_b;  // equal but for leading zeros
}

Result<RecordingLayout> InspectRecording(const fs::path& folder, ScanFormat format) {
  const Result<void> usable = CheckFolder(folder);
  if (!usable) return Forward(usable);
  const fs::path raw = folder / "velodyne_points";  // KITTI as it was recorded
  fs::path data = IfExists(folder / "velodyne");
  if (data.empty()) data = IfExists(raw / "data");
  if (data.empty()) data = folder;
  Result<std::vector<fs::path>> files = ListScanFiles(data);
  if (!files) return Forward(files);
  RecordingLayout layout;
  if (!files->empty()) {
    const Result<ScanFormat> chosen = ChooseFormat(*files, format, data);
    if (!chosen) return Forward(chosen);
    layout.format = *chosen;
    std::erase_if(*files, [&](const fs::path& file) { return FormatOf(file) != *chosen; });
  }
  if (files->empty()) {
    std::error_code ignored;
    const bool bare = fs::is_empty(data, ignored);
    return Fail(ErrorCode::kInput,
                "{}: {}; {}",
                data.string(),
                bare ? "is an empty folder" : "holds no scans that are known",
                kRemedy);
  }
  layout.files = std::move(*files);
  layout.stamp_file = IfExists(folder / "times.txt");
  if (layout.stamp_file.empty()) layout.stamp_file = IfExists(raw / "timestamps.txt");
  layout.point_time_folder = IfHoldsFiles(folder / "timestamps");
  return layout;
}

}  // namespace covsplat
