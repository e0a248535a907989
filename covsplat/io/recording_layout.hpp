// What lies where in the folder of a recording.
#pragma once

#include <array>
#include <filesystem>
#include <string_view>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/result.hpp"

namespace covsplat {

/// Kind of the files that hold the scans.
enum class ScanFormat { kAuto, kKitti, kPcd, kPly };

template <>
struct EnumNames<ScanFormat> {
  static constexpr std::array<EnumName<ScanFormat>, 4> kNames = {{{ScanFormat::kAuto, "auto"},
                                                                  {ScanFormat::kKitti, "kitti"},
                                                                  {ScanFormat::kPcd, "pcd"},
                                                                  {ScanFormat::kPly, "ply"}}};
};

struct RecordingLayout {
  ScanFormat format = ScanFormat::kKitti;
  std::vector<std::filesystem::path> files;  ///< one per scan, in order of the numbers in the names
  std::filesystem::path stamp_file;          ///< times.txt, KITTI's raw timestamps.txt, or empty
  std::filesystem::path point_time_folder;   ///< timestamps/ if anything is in it, or empty
};

/// Looks for scans in `folder/velodyne`, `folder/velodyne_points/data`, or else in the folder
/// itself. `format` kAuto takes the one kind of scan files that is there. Errors say what was
/// looked for.
Result<RecordingLayout> InspectRecording(const std::filesystem::path& folder, ScanFormat format);

/// Order of names in which numbers count as numbers: scan_2 before scan_10.
bool NaturalLess(std::string_view a, std::string_view b);

}  // namespace covsplat
