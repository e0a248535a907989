#include "covsplat/splat/cpu/binning.hpp"

#include <array>

namespace covsplat {
namespace {

constexpr int kKeyBits = 22;  // 0.03 mm at 120 m: finer than ranges are known
constexpr int kDigitBits = 11;
constexpr std::uint32_t kDigits = 1u << kDigitBits;

bool IsEmpty(const TileBox& box) { return box.x1 < box.x0 || box.y1 < box.y0; }

std::uint32_t TileCount(const TileBox& box) {
  return IsEmpty(box) ? 0u
                      : static_cast<std::uint32_t>((box.x1 - box.x0 + 1) * (box.y1 - box.y0 + 1));
}

int WrapTile(int x, int tile_columns) {
  return x < 0 ? x + tile_columns : x >= tile_columns ? x - tile_columns : x;
}

}  // namespace

template <class S>
void TileBinner::Bin(const ViewGeometry<S>& view,
                     std::span<const SurfelRecord<S>> records,
                     std::span<const TileBox> boxes) {
  const S keys_per_m = static_cast<S>((1u << kKeyBits) - 1) / view.far_m;
  order_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (IsEmpty(boxes[i])) continue;
    order_.push_back(
        {static_cast<std::uint32_t>(records[i].range * keys_per_m), static_cast<std::uint32_t>(i)});
  }
  SortByKey();
  CountSlots(boxes);
  Scatter(view.tile_columns, view.tile_rows, boxes);
}

// Two stable counting passes, least significant digit first.
void TileBinner::SortByKey() {
  scratch_.resize(order_.size());
  for (int shift = 0; shift < kKeyBits; shift += kDigitBits) {
    std::array<std::uint32_t, kDigits> start{};
    for (const KeyedRecord& item : order_) ++start[(item.key >> shift) & (kDigits - 1)];
    std::uint32_t sum = 0;
    for (std::uint32_t& count : start) {
      const std::uint32_t begin = sum;
      sum += count;
      count = begin;
    }
    for (const KeyedRecord& item : order_) {
      scratch_[start[(item.key >> shift) & (kDigits - 1)]++] = item;
    }
    order_.swap(scratch_);
  }
}

void TileBinner::CountSlots(std::span<const TileBox> boxes) {
  bins_.slot_begin.resize(boxes.size() + 1);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    bins_.slot_begin[i] = sum;
    sum += TileCount(boxes[i]);
  }
  bins_.slot_begin[boxes.size()] = sum;
  bins_.pairs.resize(sum);
}

void TileBinner::Scatter(int tile_columns, int tile_rows, std::span<const TileBox> boxes) {
  const auto tiles = static_cast<std::size_t>(tile_columns) * static_cast<std::size_t>(tile_rows);
  cursor_.assign(tiles + 1, 0);
  const auto for_each_tile = [&](const TileBox& box, auto&& visit) {
    for (int y = box.y0; y <= box.y1; ++y) {
      for (int x = box.x0; x <= box.x1; ++x) {
        visit(static_cast<std::size_t>(y * tile_columns + WrapTile(x, tile_columns)));
      }
    }
  };
  for (const KeyedRecord& item : order_) {
    for_each_tile(boxes[item.record], [&](std::size_t tile) { ++cursor_[tile + 1]; });
  }
  for (std::size_t tile = 0; tile < tiles; ++tile) cursor_[tile + 1] += cursor_[tile];
  bins_.tile_begin.assign(cursor_.begin(), cursor_.end() - 1);
  for (const KeyedRecord& item : order_) {
    std::uint32_t slot = bins_.slot_begin[item.record];
    for_each_tile(boxes[item.record], [&](std::size_t tile) {
      bins_.pairs[cursor_[tile]++] = {item.record, slot++};
    });
  }
  bins_.tile_end.assign(cursor_.begin(), cursor_.end() - 1);
}

template void TileBinner::Bin(const ViewGeometry<float>&,
                              std::span<const SurfelRecord<float>>,
                              std::span<const TileBox>);
template void TileBinner::Bin(const ViewGeometry<double>&,
                              std::span<const SurfelRecord<double>>,
                              std::span<const TileBox>);

}  // namespace covsplat
