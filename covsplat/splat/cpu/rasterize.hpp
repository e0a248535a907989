// The tile kernels: blending front to back, the loss of each pixel, and the gradient back to front.
#pragma once

#include "covsplat/splat/cpu/raster_data.hpp"

namespace covsplat {

/// Everything a tile needs. `upstream` adds a gradient on the images to that of the loss.
template <class S>
struct TileJob {
  const ViewGeometry<S>* view = nullptr;
  const SurfelRecord<S>* records = nullptr;
  TileBins* bins = nullptr;
  /// Drop the pairs that no pixel sees from the tiles' lists: hidden Gaussians and the corners of
  /// boxes. Right for a few optimiser steps, in which footprints hardly change.
  bool drop_unseen = false;
  TileImages<S>* images = nullptr;

  // For gradients only.
  const TileTargets<S>* targets = nullptr;
  const LossConfig* loss = nullptr;
  const TileGradients<S>* upstream = nullptr;  ///< may be null
  S* slots = nullptr;                          ///< [slots x 16]
  SlotState* slot_state = nullptr;             ///< [slots]
};

/// Renders tiles [begin, end) into `images`.
template <class S>
void RenderTiles(const TileJob<S>& job, std::size_t begin, std::size_t end);

/// Renders tiles [begin, end), evaluates the loss of their pixels and leaves its gradient in the
/// slots. Tiles without any measurement are skipped unless there is an upstream gradient. `images`
/// are only written if there is one, or if the loss learns through the screen-space filter.
template <class S>
LossSums StepTiles(const TileJob<S>& job, std::size_t begin, std::size_t end);

}  // namespace covsplat
