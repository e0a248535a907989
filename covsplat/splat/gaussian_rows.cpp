#include "covsplat/splat/gaussian_rows.hpp"

#include <algorithm>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr float kInvisibleLogit = -30.0f;

template <class S>
AnchorTransform<S> ToTransform(const SE3& T_sensor_anchor) {
  AnchorTransform<S> transform;
  const Eigen::Matrix3d rotation = T_sensor_anchor.RotationMatrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) transform.rotation[3 * i + j] = static_cast<S>(rotation(i, j));
    transform.translation[i] = static_cast<S>(T_sensor_anchor.Translation()[i]);
  }
  return transform;
}

}  // namespace

void MakeInert(GaussianColumns<float>& table, std::size_t begin, std::size_t end) {
  for (int p = 0; p < kParameterCount; ++p) {
    const float value = p == kQuatW ? 1.0f : p == kOpacityLogit ? kInvisibleLogit : 0.0f;
    std::fill(table.Column(p) + begin, table.Column(p) + end, value);
  }
}

KeptRows KeepRows(std::span<const AnchorRange> ranges, std::span<const std::uint8_t> keep) {
  std::vector<AnchorRange> by_anchor(ranges.begin(), ranges.end());
  std::ranges::stable_sort(by_anchor, {}, &AnchorRange::anchor);
  KeptRows kept;
  std::vector<std::size_t>& rows = kept.old_row;
  for (auto range = by_anchor.begin(); range != by_anchor.end();) {
    AnchorRange now{range->anchor, rows.size(), 0};
    for (; range != by_anchor.end() && range->anchor == now.anchor; ++range) {
      for (std::size_t i = range->begin; i < range->end; ++i) {
        if (keep[i] != 0) rows.push_back(i);
      }
    }
    now.end = rows.size();
    if (now.end == now.begin) continue;
    kept.ranges.push_back(now);
    while (rows.size() < RoundUpToBlock(now.end)) rows.push_back(rows.size());
  }
  return kept;
}

template <class S>
void ChooseBlocks(const SE3& T_map_sensor,
                  double far_m,
                  std::span<const AnchorRange> ranges,
                  std::span<const SE3> T_map_anchor,
                  std::vector<GaussianBlock>& blocks,
                  std::vector<AnchorTransform<S>>& transforms) {
  blocks.clear();
  transforms.clear();
  const SE3 T_sensor_map = T_map_sensor.Inverse();
  for (const AnchorRange& range : ranges) {
    const SE3 T_sensor_anchor = T_sensor_map * T_map_anchor[static_cast<std::size_t>(range.anchor)];
    if (T_sensor_anchor.Translation().norm() > 2.0 * far_m) continue;
    const auto transform = static_cast<std::uint16_t>(transforms.size());
    transforms.push_back(ToTransform<S>(T_sensor_anchor));
    COVSPLAT_CHECK(range.begin % kBlockSize == 0);
    COVSPLAT_CHECK(transforms.size() < 65536);
    for (std::size_t begin = range.begin; begin < range.end; begin += kBlockSize) {
      const std::size_t count = std::min(kBlockSize, range.end - begin);
      blocks.push_back(
          {static_cast<std::uint32_t>(begin), static_cast<std::uint16_t>(count), transform});
    }
  }
}

template void ChooseBlocks<float>(const SE3&,
                                  double,
                                  std::span<const AnchorRange>,
                                  std::span<const SE3>,
                                  std::vector<GaussianBlock>&,
                                  std::vector<AnchorTransform<float>>&);
template void ChooseBlocks<double>(const SE3&,
                                   double,
                                   std::span<const AnchorRange>,
                                   std::span<const SE3>,
                                   std::vector<GaussianBlock>&,
                                   std::vector<AnchorTransform<double>>&);

}  // namespace covsplat
