// Cleaning of extracted surfaces.
#pragma once

#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat {

/// Removes connected pieces with less area than `min_area_m2`, and the vertices that only they use;
/// the order of the rest stays.
void DropSmallComponents(double min_area_m2, TriangleMesh& mesh);

}  // namespace covsplat
