// Binning: which Gaussians each tile has to blend, front to back.
#pragma once

#include "covsplat/core/parallel.hpp"
#include "covsplat/splat/cpu/raster_data.hpp"

namespace covsplat {

/// Tiles that follow each other in a row; who works on one works on all, in order.
inline constexpr std::size_t kSlotGroup = 4;

/// Sorts the visible records once by the range of their centres (ties by index), then scatters them
/// into the tiles of their boxes, so that every list comes out sorted. Scratch memory and result
/// are kept from call to call.
class TileBinner {
 public:
  explicit TileBinner(ThreadPool& pool) : pool_(pool) {}

  /// `boxes` and `records`: one per record. Result in Bins(), without slots.
  template <class S>
  void Bin(const ViewGeometry<S>& view,
           std::span<const SurfelRecord<S>> records,
           std::span<const TileBox> boxes);

  /// Gives the pairs that are in the tiles' lists their slots, ordered by record, then by tile.
  /// Pairs of one record in the same group of kSlotGroup tiles share one.
  /// Best when what no pixel sees has been dropped: slots are then few and lie close together.
  void AssignSlots();

  const TileBins& Bins() const { return bins_; }
  /// For dropping pairs that turn out to be invisible.
  TileBins& Bins() { return bins_; }

 private:
  void SortByKey();
  void Scatter(int tile_columns, int tile_rows, std::span<const TileBox> boxes);
  /// Turns the counts of `cursor_` into where each chunk writes its first pair in each tile.
  void PlaceChunks(std::size_t tiles, std::size_t chunks);

  struct KeyedRecord {
    std::uint32_t key;
    std::uint32_t record;
  };

  ThreadPool& pool_;
  TileBins bins_;
  std::size_t records_ = 0;
  std::vector<KeyedRecord> order_;
  std::vector<KeyedRecord> scratch_;
  std::vector<std::uint32_t> last_group_;  ///< [records] that slots were assigned to
  std::vector<std::uint32_t> cursor_;      ///< [chunks of order_ x tiles]
};

}  // namespace covsplat
