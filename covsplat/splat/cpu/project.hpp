// Projection: Gaussians of the map become surfel records and tile boxes of one view.
#pragma once

#include "covsplat/splat/cpu/raster_data.hpp"

namespace covsplat {

template <class S>
struct ProjectJob {
  const GaussianColumns<S>* gaussians = nullptr;
  const GaussianBlock* blocks = nullptr;
  const AnchorTransform<S>* transforms = nullptr;
  const ViewGeometry<S>* view = nullptr;
  SurfelRecord<S>* records = nullptr;  ///< [16 x blocks]
  TileBox* boxes = nullptr;            ///< [16 x blocks], or null: records only
};

/// Projects the blocks whose numbers are listed. A box holds every pixel that the Gaussian can
/// reach with alpha_min at least (tight ellipse bound, exact over the azimuth seam), and half a
/// pixel more so that it survives a few optimiser steps.
template <class S>
void ProjectBlocks(const ProjectJob<S>& job, std::span<const std::uint32_t> block_numbers);

}  // namespace covsplat
