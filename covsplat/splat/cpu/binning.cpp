#include "covsplat/splat/cpu/binning.hpp"

#include <array>
#include <numeric>
#include <utility>

namespace covsplat {
namespace {

constexpr int kKeyBits = 22;  // 0.03 mm at 120 m: finer than ranges are known
constexpr int kDigitBits = 11;
constexpr std::uint32_t kDigits = 1u << kDigitBits;

/// Records that one task counts and scatters; few tasks, as each has its own counts of all tiles.
constexpr std::size_t kRecordsPerChunk = 16384;

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
  records_ = records.size();
  bins_.slot_begin.clear();
  SortByKey();
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

void TileBinner::Scatter(int tile_columns, int tile_rows, std::span<const TileBox> boxes) {
  const auto tiles = static_cast<std::size_t>(tile_columns) * static_cast<std::size_t>(tile_rows);
  const std::size_t chunks = (order_.size() + kRecordsPerChunk - 1) / kRecordsPerChunk;
  cursor_.assign(tiles * chunks, 0);
  // visit(record, where the chunk's number for the tile is) for every pair.
  const auto for_each_pair = [&](auto&& visit) {
    ParallelFor(pool_, order_.size(), kRecordsPerChunk, [&](std::size_t begin, std::size_t end) {
      std::uint32_t* cursor = cursor_.data() + tiles * (begin / kRecordsPerChunk);
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t record = order_[i].record;
        const TileBox& box = boxes[record];
        for (int y = box.y0; y <= box.y1; ++y) {
          for (int x = box.x0; x <= box.x1; ++x) {
            visit(record, cursor[y * tile_columns + WrapTile(x, tile_columns)]);
          }
        }
      }
    });
  };
  for_each_pair([](std::uint32_t /*record*/, std::uint32_t& count) { ++count; });
  PlaceChunks(tiles, chunks);
  for_each_pair([&](std::uint32_t record, std::uint32_t& next) {
    bins_.pairs[next++] = {record, 0};
  });
}

void TileBinner::PlaceChunks(std::size_t tiles, std::size_t chunks) {
  bins_.tile_begin.resize(tiles);
  bins_.tile_end.resize(tiles);
  std::uint32_t sum = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    bins_.tile_begin[tile] = sum;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      sum += std::exchange(cursor_[tiles * chunk + tile], sum);
    }
    bins_.tile_end[tile] = sum;
  }
  bins_.pairs.resize(sum);
}

void TileBinner::AssignSlots() {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  // visit(pair, whether its record has had a pair in the same group of tiles).
  const auto for_each_pair = [&](auto&& visit) {
    last_group_.assign(records_, kNone);
    for (std::size_t tile = 0; tile < bins_.tile_begin.size(); ++tile) {
      const auto group = static_cast<std::uint32_t>(tile / kSlotGroup);
      for (std::uint32_t k = bins_.tile_begin[tile]; k < bins_.tile_end[tile]; ++k) {
        TilePair& pair = bins_.pairs[k];
        visit(pair, std::exchange(last_group_[pair.record], group) == group);
      }
    }
  };
  // Counted two places ahead, then summed up, slot_begin[record + 1] is where the record begins,
  // and has moved on to where it ends when all its pairs have taken their slots.
  std::vector<std::uint32_t>& next = bins_.slot_begin;
  next.assign(records_ + 2, 0);
  for_each_pair(
      [&](const TilePair& pair, bool shares) { next[pair.record + 2] += shares ? 0 : 1; });
  std::partial_sum(next.begin(), next.end(), next.begin());
  for_each_pair([&](TilePair& pair, bool shares) {
    next[pair.record + 1] += shares ? 0 : 1;
    pair.slot = next[pair.record + 1] - 1;
  });
  next.pop_back();
}

template void TileBinner::Bin(const ViewGeometry<float>&,
                              std::span<const SurfelRecord<float>>,
                              std::span<const TileBox>);
template void TileBinner::Bin(const ViewGeometry<double>&,
                              std::span<const SurfelRecord<double>>,
                              std::span<const TileBox>);

}  // namespace covsplat
