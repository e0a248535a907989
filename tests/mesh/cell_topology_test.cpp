#include "covsplat/mesh/cell_topology.hpp"

#include <set>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

bool Inside(unsigned mask, int corner) { return (mask >> corner & 1u) != 0; }

/// Edges of the face at `side` along an axis that the surface crosses, by the sheet they belong to.
std::set<std::set<int>> GroupsOnFace(unsigned mask, int axis, int side) {
  const CellSheets& sheets = SheetsOf(mask);
  std::array<std::set<int>, 4> by_sheet;
  for (int e = 0; e < kCellEdges; ++e) {
    const CellEdge& edge = CellEdges()[static_cast<std::size_t>(e)];
    if ((edge.from >> axis & 1) != side || (edge.to >> axis & 1) != side) continue;
    const int sheet = sheets.sheet_of_edge[static_cast<std::size_t>(e)];
    if (sheet >= 0) by_sheet[static_cast<std::size_t>(sheet)].insert(e);
  }
  std::set<std::set<int>> groups;
  for (const auto& group : by_sheet) {
    if (!group.empty()) groups.insert(group);
  }
  return groups;
}

TEST(CellTopology, EveryCrossedEdgeBelongsToOneSheetAndNoOtherEdgeDoes) {
  for (unsigned mask = 0; mask < 256; ++mask) {
    const CellSheets& sheets = SheetsOf(mask);
    EXPECT_LE(sheets.count, 4);
    EXPECT_EQ(sheets.count == 0, mask == 0 || mask == 255);
    for (int e = 0; e < kCellEdges; ++e) {
      const CellEdge& edge = CellEdges()[static_cast<std::size_t>(e)];
      const int sheet = sheets.sheet_of_edge[static_cast<std::size_t>(e)];
      const bool crossed = Inside(mask, edge.from) != Inside(mask, edge.to);
      EXPECT_EQ(crossed, sheet >= 0) << mask << " " << e;
      EXPECT_LT(sheet, sheets.count);
    }
  }
}

TEST(CellTopology, ASheetMeetsEveryFaceInPairsOfEdges) {
  for (unsigned mask = 0; mask < 256; ++mask) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        for (const auto& group : GroupsOnFace(mask, axis, side)) {
          EXPECT_EQ(group.size() % 2, 0u) << mask;
        }
      }
    }
  }
}

TEST(CellTopology, TwoWallsThroughOneCellAreTwoSheets) {
  // Inside at x = 0, y = 0 and at x = 1, y = 1: two bars along z that touch at no face but share
  // the ambiguous ones, where the inside stays connected.
  unsigned bars = 0, corners = 0;
  for (int c = 0; c < 8; ++c) {
    if ((c & 1) == (c >> 1 & 1)) bars |= 1u << c;
  }
  EXPECT_EQ(SheetsOf(bars).count, 2);
  corners = 1u << 0 | 1u << 7;  // opposite corners share no face
  EXPECT_EQ(SheetsOf(corners).count, 2);
}

}  // namespace
}  // namespace covsplat
