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

std::size_t Rows(const AnchorRange& range) { return range.end - range.begin; }

KeptRows CloseUp(std::span<const AnchorRange> ranges, std::span<const std::uint8_t> keep) {
  KeptRows kept;
  for (const AnchorRange& range : ranges) {
    std::size_t to = range.begin;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      if (keep[i] != 0) kept.moves.Add(to++, i);
    }
    if (to > range.begin) kept.ranges.push_back({range.anchor, range.begin, to});
  }
  kept.moves.size = kept.ranges.empty() ? 0 : RoundUpToBlock(kept.ranges.back().end);
  return kept;
}

/// Whether an eighth of the rows would be saved by joining the ranges of each anchor.
bool IsWasteful(const KeptRows& kept) {
  std::vector<std::size_t> of_anchor;
  std::size_t rows = 0;
  for (const AnchorRange& range : kept.ranges) {
    const auto anchor = static_cast<std::size_t>(range.anchor);
    if (anchor >= of_anchor.size()) of_anchor.resize(anchor + 1, 0);
    of_anchor[anchor] += Rows(range);
    rows += Rows(range);
  }
  std::size_t joined = 0;
  for (const std::size_t count : of_anchor) joined += RoundUpToBlock(count);
  return kept.moves.size > joined + rows / 8;
}

KeptRows JoinRanges(std::span<const AnchorRange> ranges, std::span<const std::uint8_t> keep) {
  std::vector<AnchorRange> by_anchor(ranges.begin(), ranges.end());
  std::ranges::stable_sort(by_anchor, {}, &AnchorRange::anchor);
  KeptRows kept;
  for (auto range = by_anchor.begin(); range != by_anchor.end();) {
    AnchorRange now{range->anchor, kept.moves.size, kept.moves.size};
    for (; range != by_anchor.end() && range->anchor == now.anchor; ++range) {
      for (std::size_t i = range->begin; i < range->end; ++i) {
        if (keep[i] != 0) kept.moves.Add(now.end++, i);
      }
    }
    if (Rows(now) == 0) continue;
    kept.ranges.push_back(now);
    kept.moves.size = RoundUpToBlock(now.end);
  }
  return kept;
}

}  // namespace

void RowMoves::Add(std::size_t to, std::size_t from) {
  if (to == from) return;
  const bool goes_on = !runs.empty() && to == runs.back().to + runs.back().count &&
                       from == runs.back().from + runs.back().count;
  if (goes_on) {
    ++runs.back().count;
  } else {
    runs.push_back({to, from, 1});
  }
}

void MakeInert(GaussianColumns<float>& table, std::size_t begin, std::size_t end) {
  for (int p = 0; p < kParameterCount; ++p) {
    const float value = p == kQuatW ? 1.0f : p == kOpacityLogit ? kInvisibleLogit : 0.0f;
    std::fill(table.Column(p) + begin, table.Column(p) + end, value);
  }
}

KeptRows KeepRows(std::span<const AnchorRange> ranges, std::span<const std::uint8_t> keep) {
  KeptRows kept = CloseUp(ranges, keep);
  return IsWasteful(kept) ? JoinRanges(ranges, keep) : kept;
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
