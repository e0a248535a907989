// Normals of the rendered surface: the N_surf of paper eq. 12.
#pragma once

#include "covsplat/core/parallel.hpp"
#include "covsplat/splat/cpu/raster_data.hpp"

namespace covsplat {

/// Neighbouring pixels are on one surface if their ranges differ by less than this share.
inline constexpr float kMaxRelativeStep = 0.1f;

/// Fills `targets.surface_*` with the normals of the rendered range image, from central differences
/// of the back-projected pixels, facing the sensor. Where a neighbour is not rendered (opacity
/// below `min_alpha`) or lies on another surface there is no normal, so that edges and holes do not
/// invent any. The normals enter the loss as constants: their own gradient would couple every pixel
/// with its neighbours for a term that only steadies orientations.
void FindSurfaceNormals(const ViewGeometry<float>& view,
                        const TileImages<float>& images,
                        double min_alpha,
                        ThreadPool& pool,
                        TileTargets<float>& targets);

}  // namespace covsplat
