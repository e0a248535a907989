#include "apps/run_truth.hpp"

#include "covsplat/io/recording_layout.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {

Result<Trajectory> LoadForRecording(const std::filesystem::path& file,
                                    const std::filesystem::path& recording,
                                    double scan_period_s) {
  const auto layout = InspectRecording(recording, ScanFormat::kAuto);
  if (!layout) return Forward(layout);
  std::vector<double> stamps;
  if (!layout->stamp_file.empty()) {
    Result<std::vector<double>> read = ReadStamps(layout->stamp_file);
    if (!read) return Forward(read);
    stamps = std::move(*read);
  } else {
    for (std::size_t i = 0; i < layout->files.size(); ++i) {
      stamps.push_back(static_cast<double>(i) * scan_period_s);
    }
  }
  return LoadTrajectory(file, stamps);
}

Result<std::optional<GroundTruth>> LoadTruth(const std::filesystem::path& recording,
                                             const std::optional<std::filesystem::path>& given,
                                             double scan_period_s) {
  if (!given) return FindGroundTruth(recording, scan_period_s);
  Result<Trajectory> trajectory = LoadForRecording(*given, recording, scan_period_s);
  if (!trajectory) return Forward(trajectory);
  return GroundTruth{*given, std::move(*trajectory)};
}

}  // namespace covsplat
