#include "apps/loop_log.hpp"

#include <string>

#include <fmt/format.h>

#include "covsplat/core/enum_name.hpp"
#include "covsplat/io/output_file.hpp"
#include "covsplat/loops/g2o_file.hpp"

namespace covsplat {
namespace {

std::string Row(const LoopRecord& loop, std::span<const std::int64_t> keyframe_scans) {
  return fmt::format("{},{},{},{},{},{:.2f},{:.3f},{:.4f},{:.4f},{:.4f},{:.3f},{}\n",
                     loop.old_keyframe,
                     loop.new_keyframe,
                     keyframe_scans[static_cast<std::size_t>(loop.old_keyframe)],
                     keyframe_scans[static_cast<std::size_t>(loop.new_keyframe)],
                     NameOfEnum(loop.hint),
                     loop.way_m,
                     loop.drift_m,
                     loop.check.overlap,
                     loop.check.rms_m,
                     loop.check.seen_through,
                     loop.moved_m,
                     NameOfEnum(loop.check.fate));
}

}  // namespace

Result<void> WriteLoops(const std::filesystem::path& folder,
                        const LoopCloser& closer,
                        std::span<const std::int64_t> keyframe_scans) {
  std::string text =
      "old_keyframe,new_keyframe,old_scan,new_scan,hint,way_m,drift_m,overlap,rms_m,seen_through,"
      "moved_m,fate\n";
  for (const LoopRecord& loop : closer.Loops()) text += Row(loop, keyframe_scans);
  return WriteFileAtomically(folder / "loops.csv", text).and_then([&] {
    return WriteG2o(folder / "pose_graph.g2o", closer.Graph());
  });
}

}  // namespace covsplat
