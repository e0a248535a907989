// How a surface passes through a cube of eight samples.
#pragma once

#include <array>
#include <cstdint>

namespace covsplat {

/// Corners of a cell are numbered x + 2 y + 4 z. Edge 4 a + u + 2 v runs along axis a from the
/// corner that is `u` along the next axis and `v` along the one after that (axes in a circle).
inline constexpr int kCellEdges = 12;

struct CellEdge {
  int axis = 0;
  int from = 0;  ///< corner
  int to = 0;    ///< corner
};

const std::array<CellEdge, kCellEdges>& CellEdges();

/// The sheets of the surface in a cell; each becomes one vertex of the mesh.
struct CellSheets {
  int count = 0;
  std::array<std::int8_t, kCellEdges> sheet_of_edge;  ///< -1 where the surface does not cross
};

/// `negative`: bit c is set if the sample at corner c is inside. On a face whose corners change
/// sign four times the inside stays connected, whichever cell looks at it, so that sheets of
/// neighbouring cells fit together and thin walls do not break up.
const CellSheets& SheetsOf(unsigned negative);

}  // namespace covsplat
