#include "apps/keyframe_log.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "covsplat/io/output_file.hpp"

namespace covsplat {

Result<void> WriteKeyframes(const std::filesystem::path& folder,
                            std::span<const KeyframeTraining> training,
                            std::span<const std::int64_t> keyframe_scans) {
  std::string text = "keyframe,scan,steps,loss\n";
  for (std::size_t k = 0; k < training.size(); ++k) {
    text += fmt::format("{},{},{},", k, keyframe_scans[k], training[k].steps);
    if (std::isfinite(training[k].loss)) text += fmt::format("{:.5f}", training[k].loss);
    text += "\n";
  }
  return WriteFileAtomically(folder / "keyframes.csv", text);
}

}  // namespace covsplat
