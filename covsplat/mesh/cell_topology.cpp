#include "covsplat/mesh/cell_topology.hpp"

#include <numeric>
#include <vector>

namespace covsplat {
namespace {

std::array<CellEdge, kCellEdges> MakeEdges() {
  std::array<CellEdge, kCellEdges> edges;
  for (int axis = 0; axis < 3; ++axis) {
    const int next = 1 << (axis + 1) % 3;
    const int last = 1 << (axis + 2) % 3;
    for (int k = 0; k < 4; ++k) {
      const int from = (k & 1) * next + (k >> 1) * last;
      const int e = 4 * axis + k;
      edges[static_cast<std::size_t>(e)] = {axis, from, from + (1 << axis)};
    }
  }
  return edges;
}

int EdgeBetween(int a, int b) {
  const auto& edges = CellEdges();
  for (int e = 0; e < kCellEdges; ++e) {
    const CellEdge& edge = edges[static_cast<std::size_t>(e)];
    if ((edge.from == a && edge.to == b) || (edge.from == b && edge.to == a)) return e;
  }
  return -1;
}

/// The four corners of a face, in a circle.
std::array<int, 4> FaceCorners(int axis, int side) {
  const int base = side << axis;
  const int next = 1 << (axis + 1) % 3;
  const int last = 1 << (axis + 2) % 3;
  return {base, base + next, base + next + last, base + last};
}

/// Edges of one sheet have one root.
class EdgeSets {
 public:
  EdgeSets() { std::iota(parent_.begin(), parent_.end(), 0); }
  int Root(int e) const {
    while (parent_[static_cast<std::size_t>(e)] != e) e = parent_[static_cast<std::size_t>(e)];
    return e;
  }
  void Join(int a, int b) { parent_[static_cast<std::size_t>(Root(a))] = Root(b); }

 private:
  std::array<int, kCellEdges> parent_{};
};

/// Joins the crossed edges of a face that the surface connects across it.
void JoinAcrossFace(const std::array<int, 4>& corners, unsigned negative, EdgeSets& sets) {
  const auto inside = [&](int k) {
    return (negative >> corners[static_cast<std::size_t>(k % 4)] & 1u) != 0;
  };
  std::vector<int> crossed;  // edge k joins corners k and k + 1
  for (int k = 0; k < 4; ++k) {
    if (inside(k) != inside(k + 1)) crossed.push_back(k);
  }
  const auto edge = [&](int k) {
    return EdgeBetween(corners[static_cast<std::size_t>(k % 4)],
                       corners[static_cast<std::size_t>((k + 1) % 4)]);
  };
  if (crossed.size() == 2) sets.Join(edge(crossed[0]), edge(crossed[1]));
  if (crossed.size() != 4) return;
  for (int k = 0; k < 4; ++k) {
    if (!inside(k)) sets.Join(edge(k + 3), edge(k));  // cuts off the corner in the open
  }
}

CellSheets MakeSheets(unsigned negative) {
  EdgeSets sets;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) JoinAcrossFace(FaceCorners(axis, side), negative, sets);
  }
  CellSheets sheets;
  sheets.sheet_of_edge.fill(-1);
  std::array<int, kCellEdges> sheet_of_root;
  sheet_of_root.fill(-1);
  for (int e = 0; e < kCellEdges; ++e) {
    const CellEdge& edge = CellEdges()[static_cast<std::size_t>(e)];
    if ((negative >> edge.from & 1u) == (negative >> edge.to & 1u)) continue;
    int& sheet = sheet_of_root[static_cast<std::size_t>(sets.Root(e))];
    if (sheet < 0) sheet = sheets.count++;
    sheets.sheet_of_edge[static_cast<std::size_t>(e)] = static_cast<std::int8_t>(sheet);
  }
  return sheets;
}

}  // namespace

const std::array<CellEdge, kCellEdges>& CellEdges() {
  static const std::array<CellEdge, kCellEdges> edges = MakeEdges();
  return edges;
}

const CellSheets& SheetsOf(unsigned negative) {
  static const std::array<CellSheets, 256> table = [] {
    std::array<CellSheets, 256> all;
    for (unsigned mask = 0; mask < 256; ++mask) all[mask] = MakeSheets(mask);
    return all;
  }();
  return table[negative];
}

}  // namespace covsplat
