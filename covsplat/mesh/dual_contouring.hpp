// Dual contouring: the surface where a signed distance field is zero.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "covsplat/core/parallel.hpp"
#include "covsplat/core/triangle_mesh.hpp"
#include "covsplat/mesh/voxel_grid.hpp"

namespace covsplat {

/// Names a vertex across tiles: cell and sheet. In order of cells (z, y, x).
using VertexKey = std::uint64_t;

struct SurfaceVertex {
  VertexKey key = 0;
  Eigen::Vector3f position;  ///< map frame, m
  Eigen::Vector3f normal;    ///< unit, to the open side
};

/// The part of a surface that a tile owns. Corners may be vertices of other tiles.
struct SurfacePiece {
  std::vector<SurfaceVertex> vertices;
  std::vector<std::array<VertexKey, 4>> quads;  ///< counter-clockwise from the open side
};

struct ContourOptions {
  double min_weight = 0.5;
  double sharpness = 0.9;
};

/// Contours the cells and edges whose first corner lies in a block of `own` (in BlockOrder); the
/// grid must hold their neighbours as far as those exist. A cell with a corner of less than the
/// minimal weight has no surface.
SurfacePiece Contour(const VoxelGrid& grid,
                     const std::vector<BlockIndex>& own,
                     const ContourOptions& options,
                     ThreadPool& pool);

/// Joins pieces into one mesh, which depends on neither their number nor their order. Vertices that
/// no quad uses are left out.
TriangleMesh JoinPieces(std::vector<SurfacePiece> pieces);

}  // namespace covsplat
