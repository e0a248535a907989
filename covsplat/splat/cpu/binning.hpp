// Binning: which Gaussians each tile has to blend, front to back.
#pragma once

#include "covsplat/splat/cpu/raster_data.hpp"

namespace covsplat {

/// Sorts the visible records once by the range of their centres (ties by index), then scatters them
/// into the tiles of their boxes, so that every list comes out sorted. Scratch memory and result
/// are kept from call to call.
class TileBinner {
 public:
  /// `boxes` and `records`: one per record. Result in Bins().
  template <class S>
  void Bin(const ViewGeometry<S>& view,
           std::span<const SurfelRecord<S>> records,
           std::span<const TileBox> boxes);

  const TileBins& Bins() const { return bins_; }
  /// For dropping pairs that turn out to be invisible.
  TileBins& Bins() { return bins_; }

 private:
  void SortByKey();
  void CountSlots(std::span<const TileBox> boxes);
  void Scatter(int tile_columns, int tile_rows, std::span<const TileBox> boxes);

  struct KeyedRecord {
    std::uint32_t key;
    std::uint32_t record;
  };

  TileBins bins_;
  std::vector<KeyedRecord> order_;
  std::vector<KeyedRecord> scratch_;
  std::vector<std::uint32_t> cursor_;
};

}  // namespace covsplat
