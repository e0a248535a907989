// ScanSource: where scans come from, one after the other.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "covsplat/core/result.hpp"
#include "covsplat/core/scan.hpp"
#include "covsplat/io/recording_layout.hpp"

namespace covsplat {

class ScanSource {
 public:
  virtual ~ScanSource() = default;

  /// The next scan, or nothing at the end of the recording. After an error, which names the file,
  /// the next call goes on with the scan that follows.
  virtual Result<std::optional<Scan>> Next() = 0;
  /// Scans this source delivers from start to end, damaged ones included.
  virtual std::int64_t ScanCount() const = 0;
  /// For people, as in "KITTI folder, 80 scans, with times.txt, no time per point".
  virtual std::string Description() const = 0;
};

struct SourceOptions {
  ScanFormat format = ScanFormat::kAuto;
  std::int64_t first_scan = 0;                  ///< scans to leave out at the start
  std::int64_t max_scans = -1;                  ///< -1: all that follow
  double kitti_elevation_correction_deg = 0.0;  ///< added to the elevation of KITTI points
  double scan_period_s = 0.1;                   ///< from scan to scan where there are no stamps
};

/// Opens a folder of scans. Stamps come from absolute times of the points, else from times.txt
/// (one line per scan, or per number that a file has for a name), else from the names of the files
/// (StampOfName), else from the number of the scan.
Result<std::unique_ptr<ScanSource>> OpenScanSource(const std::filesystem::path& folder,
                                                   const SourceOptions& options);

}  // namespace covsplat
