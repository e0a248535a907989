// Where Gaussians are in the table: the book-keeping that all backends share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "covsplat/core/se3.hpp"
#include "covsplat/splat/gaussians.hpp"
#include "covsplat/splat/surfel_record.hpp"

namespace covsplat {

inline std::size_t RoundUpToBlock(std::size_t rows) {
  return (rows + kBlockSize - 1) / kBlockSize * kBlockSize;
}

/// Harmless values for padding rows and for rows that are about to be written.
void MakeInert(GaussianColumns<float>& table, std::size_t begin, std::size_t end);

/// What remains of a table. Rows of an anchor keep their order.
struct KeptRows {
  std::vector<AnchorRange> ranges;  ///< ascending
  RowMoves moves;
};

/// Moves rows within their ranges, which leaves padding behind, so that long tables cost no more
/// than short ones. When that has become too much the whole table moves together, and the ranges of
/// each anchor are joined.
KeptRows KeepRows(std::span<const AnchorRange> ranges, std::span<const std::uint8_t> keep);

/// The Gaussians that a view has to look at. Anchors out of reach of the sensor are left out: a
/// Gaussian is at most the sensor's range from its anchor, and the far limit holds at the view.
/// `T_map_anchor` is indexed by anchor.
template <class S>
void ChooseBlocks(const SE3& T_map_sensor,
                  double far_m,
                  std::span<const AnchorRange> ranges,
                  std::span<const SE3> T_map_anchor,
                  std::vector<GaussianBlock>& blocks,
                  std::vector<AnchorTransform<S>>& transforms);

}  // namespace covsplat
