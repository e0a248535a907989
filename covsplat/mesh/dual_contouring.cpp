#include "covsplat/mesh/dual_contouring.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "covsplat/core/check.hpp"
#include "covsplat/mesh/cell_topology.hpp"

namespace covsplat {
namespace {

constexpr int kKeyBits = 20;
constexpr int kKeyOffset = 1 << (kKeyBits - 1);
constexpr int kPaddedSide = kBlockSide + 2;
/// A plane's share in a vertex that no other plane holds, at full sharpness.
constexpr double kLeastPull = 0.02;

VertexKey KeyOf(const Eigen::Vector3i& cell, int sheet) {
  VertexKey key = 0;
  for (int axis = 2; axis >= 0; --axis) {
    key = key << kKeyBits | static_cast<VertexKey>(cell[axis] + kKeyOffset);
  }
  return key << 2 | static_cast<VertexKey>(sheet);
}

/// A block with one voxel of its neighbours on every side.
class PaddedBlock {
 public:
  PaddedBlock(const VoxelGrid& grid, const BlockIndex& block, float min_weight)
      : min_weight_(min_weight) {
    std::array<const Voxel*, 27> sources{};
    for (int n = 0; n < 27; ++n) {
      const BlockIndex offset(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      const std::int64_t number = grid.Find(block + offset);
      if (number >= 0) {
        sources[static_cast<std::size_t>(n)] = grid.Voxels(static_cast<std::size_t>(number)).data();
      }
    }
    for (int z = -1; z <= kBlockSide; ++z) {
      for (int y = -1; y <= kBlockSide; ++y) {
        for (int x = -1; x <= kBlockSide; ++x) {
          const auto part = [](int i) { return i < 0 ? 0 : i < kBlockSide ? 1 : 2; };
          const Voxel* source =
              sources[static_cast<std::size_t>(part(x) + 3 * part(y) + 9 * part(z))];
          constexpr int kMask = kBlockSide - 1;
          voxels_[Index(x, y, z)] =
              source == nullptr ? nullptr : source + VoxelInBlock(x & kMask, y & kMask, z & kMask);
        }
      }
    }
  }

  /// Null where the field is not known.
  const Voxel* Known(const Eigen::Vector3i& at) const {
    const Voxel* voxel = voxels_[Index(at.x(), at.y(), at.z())];
    return voxel != nullptr && voxel->weight >= min_weight_ ? voxel : nullptr;
  }

 private:
  static std::size_t Index(int x, int y, int z) {
    return static_cast<std::size_t>(x + 1 + kPaddedSide * (y + 1 + kPaddedSide * (z + 1)));
  }

  float min_weight_;
  std::array<const Voxel*, kPaddedSide * kPaddedSide * kPaddedSide> voxels_;
};

/// The eight samples of a cell, if all are known.
struct Cell {
  std::array<const Voxel*, 8> corner;
  unsigned negative = 0;
};

bool LoadCell(const PaddedBlock& block, const Eigen::Vector3i& at, Cell& cell) {
  cell.negative = 0;
  for (int c = 0; c < 8; ++c) {
    const Voxel* voxel = block.Known(at + Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2));
    if (voxel == nullptr) return false;
    cell.corner[static_cast<std::size_t>(c)] = voxel;
    if (voxel->distance < 0.0f) cell.negative |= 1u << c;
  }
  return true;
}

/// Slope of the trilinear field at a point of the cell.
Eigen::Vector3d SlopeAt(const Cell& cell, const Eigen::Vector3d& p) {
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (int c = 0; c < 8; ++c) {
    const double value = cell.corner[static_cast<std::size_t>(c)]->Distance();
    Eigen::Vector3d weight, sign;
    for (int k = 0; k < 3; ++k) {
      const bool upper = (c >> k & 1) != 0;
      weight[k] = upper ? p[k] : 1.0 - p[k];
      sign[k] = upper ? 1.0 : -1.0;
    }
    slope += value * Eigen::Vector3d(sign.x() * weight.y() * weight.z(),
                                     weight.x() * sign.y() * weight.z(),
                                     weight.x() * weight.y() * sign.z());
  }
  return slope;
}

/// Where the surface crosses an edge, in cell coordinates, and how it is tilted there.
struct Crossing {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
};

Crossing CrossingOf(const Cell& cell, const CellEdge& edge) {
  const Voxel& from = *cell.corner[static_cast<std::size_t>(edge.from)];
  const Voxel& to = *cell.corner[static_cast<std::size_t>(edge.to)];
  const double a = from.Distance();
  const double b = to.Distance();
  const double t = std::clamp(a / (a - b), 0.0, 1.0);
  Crossing crossing;
  crossing.point = Eigen::Vector3d(edge.from & 1, edge.from >> 1 & 1, edge.from >> 2);
  crossing.point[edge.axis] = t;
  const Eigen::Vector3d slope = SlopeAt(cell, crossing.point);
  const Eigen::Vector3d seen =
      ((1.0 - t) / static_cast<double>(from.weight)) * from.normal.cast<double>() +
      (t / static_cast<double>(to.weight)) * to.normal.cast<double>();
  // Normals of the surfels are steadier than slopes of the field, unless sides cancel.
  crossing.normal =
      seen.norm() > 0.3 && seen.dot(slope) > 0.0 ? seen.normalized() : slope.normalized();
  if (!crossing.normal.allFinite()) crossing.normal.setZero();
  return crossing;
}

/// The point nearest to all planes, drawn to the middle of the crossings where they leave it free.
SurfaceVertex VertexOf(const Cell& cell, int sheet, const CellSheets& sheets, double sharpness) {
  std::array<Crossing, kCellEdges> crossings;
  std::size_t count = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (int e = 0; e < kCellEdges; ++e) {
    if (sheets.sheet_of_edge[static_cast<std::size_t>(e)] != sheet) continue;
    crossings[count] = CrossingOf(cell, CellEdges()[static_cast<std::size_t>(e)]);
    middle += crossings[count].point;
    ++count;
  }
  middle /= static_cast<double>(count);
  Eigen::Matrix3d planes = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Crossing& crossing = crossings[i];
    planes += crossing.normal * crossing.normal.transpose();
    pull += crossing.normal * crossing.normal.dot(crossing.point - middle);
    normal += crossing.normal;
  }
  const double hold =
      static_cast<double>(count) * (kLeastPull + (1.0 - sharpness) * (1.0 - sharpness));
  planes.diagonal().array() += hold;
  const Eigen::Vector3d offset =
      sharpness > 0.0 ? Eigen::Vector3d(planes.ldlt().solve(pull)) : Eigen::Vector3d::Zero();
  SurfaceVertex vertex;
  vertex.position = (middle + offset).cwiseMax(0.0).cwiseMin(1.0).cast<float>();
  if (normal.norm() < 1e-6) normal = SlopeAt(cell, middle);
  vertex.normal = normal.normalized().cast<float>();
  if (!vertex.normal.allFinite()) vertex.normal = Eigen::Vector3f::UnitZ();
  return vertex;
}

/// Contours one block.
class BlockContour {
 public:
  BlockContour(const VoxelGrid& grid, const BlockIndex& block, const ContourOptions& options)
      : padded_(grid, block, static_cast<float>(options.min_weight)),
        first_(kBlockSide * block),
        voxel_m_(grid.VoxelSize()),
        sharpness_(options.sharpness) {}

  void AppendTo(SurfacePiece& piece) const {
    for (int z = 0; z < kBlockSide; ++z) {
      for (int y = 0; y < kBlockSide; ++y) {
        for (int x = 0; x < kBlockSide; ++x) {
          AppendVertices({x, y, z}, piece);
          for (int axis = 0; axis < 3; ++axis) AppendQuad({x, y, z}, axis, piece);
        }
      }
    }
  }

 private:
  void AppendVertices(const Eigen::Vector3i& at, SurfacePiece& piece) const {
    Cell cell;
    if (!LoadCell(padded_, at, cell)) return;
    const CellSheets& sheets = SheetsOf(cell.negative);
    for (int sheet = 0; sheet < sheets.count; ++sheet) {
      SurfaceVertex vertex = VertexOf(cell, sheet, sheets, sharpness_);
      vertex.key = KeyOf(first_ + at, sheet);
      vertex.position = (voxel_m_ * ((first_ + at).cast<double>() + vertex.position.cast<double>()))
                            .cast<float>();
      piece.vertices.push_back(vertex);
    }
  }

  /// The quad around the edge that leaves `at` along an axis, if the surface crosses it.
  void AppendQuad(const Eigen::Vector3i& at, int axis, SurfacePiece& piece) const {
    const Voxel* from = padded_.Known(at);
    const Voxel* to = padded_.Known(at + Eigen::Vector3i::Unit(axis));
    if (from == nullptr || to == nullptr) return;
    const bool inside = from->distance < 0.0f;
    if (inside == (to->distance < 0.0f)) return;
    std::array<VertexKey, 4> quad{};
    constexpr std::array<std::array<int, 2>, 4> kAround = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (std::size_t k = 0; k < 4; ++k) {
      const auto [u, v] = kAround[k];
      const Eigen::Vector3i corner = at - u * Eigen::Vector3i::Unit((axis + 1) % 3) -
                                     v * Eigen::Vector3i::Unit((axis + 2) % 3);
      Cell cell;
      if (!LoadCell(padded_, corner, cell)) return;
      const int edge = 4 * axis + u + 2 * v;
      quad[k] = KeyOf(first_ + corner,
                      SheetsOf(cell.negative).sheet_of_edge[static_cast<std::size_t>(edge)]);
    }
    if (!inside) std::swap(quad[1], quad[3]);
    piece.quads.push_back(quad);
  }

  PaddedBlock padded_;
  Eigen::Vector3i first_;
  double voxel_m_;
  double sharpness_;
};

template <class T>
void AppendAll(const std::vector<T>& from, std::vector<T>& to) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Along the shorter diagonal, which follows edges better than a fixed choice.
void AppendTriangles(const std::array<int, 4>& quad, TriangleMesh& mesh) {
  const auto at = [&](std::size_t k) -> const Eigen::Vector3f& {
    return mesh.vertices[static_cast<std::size_t>(quad[k])];
  };
  const bool first = (at(0) - at(2)).squaredNorm() <= (at(1) - at(3)).squaredNorm();
  const std::size_t k = first ? 0 : 1;
  mesh.triangles.emplace_back(quad[k], quad[k + 1], quad[k + 2]);
  mesh.triangles.emplace_back(quad[k], quad[k + 2], quad[(k + 3) % 4]);
}

}  // namespace

SurfacePiece Contour(const VoxelGrid& grid,
                     const std::vector<BlockIndex>& own,
                     const ContourOptions& options,
                     ThreadPool& pool) {
  constexpr std::size_t kBlocksPerTask = 64;
  std::vector<SurfacePiece> parts((own.size() + kBlocksPerTask - 1) / kBlocksPerTask);
  ParallelFor(pool, own.size(), kBlocksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      BlockContour(grid, own[i], options).AppendTo(parts[begin / kBlocksPerTask]);
    }
  });
  SurfacePiece piece;
  for (const SurfacePiece& part : parts) {
    AppendAll(part.vertices, piece.vertices);
    AppendAll(part.quads, piece.quads);
  }
  return piece;
}

TriangleMesh JoinPieces(std::vector<SurfacePiece> pieces) {
  SurfacePiece all;
  for (SurfacePiece& piece : pieces) {
    AppendAll(piece.vertices, all.vertices);
    AppendAll(piece.quads, all.quads);
    piece = {};
  }
  std::sort(all.vertices.begin(), all.vertices.end(), [](const auto& a, const auto& b) {
    return a.key < b.key;
  });
  std::sort(all.quads.begin(), all.quads.end());
  TriangleMesh mesh;
  std::vector<int> number(all.vertices.size(), -1);
  const auto row_of = [&](VertexKey key) {
    const auto at =
        std::lower_bound(all.vertices.begin(),
                         all.vertices.end(),
                         key,
                         [](const SurfaceVertex& vertex, VertexKey k) { return vertex.key < k; });
    COVSPLAT_CHECK(at != all.vertices.end() && at->key == key);
    return static_cast<std::size_t>(at - all.vertices.begin());
  };
  std::vector<std::array<std::size_t, 4>> rows;
  for (const auto& quad : all.quads) {
    rows.push_back({row_of(quad[0]), row_of(quad[1]), row_of(quad[2]), row_of(quad[3])});
    for (const std::size_t row : rows.back()) number[row] = 0;
  }
  for (std::size_t row = 0; row < number.size(); ++row) {
    if (number[row] < 0) continue;
    number[row] = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(all.vertices[row].position);
    mesh.normals.push_back(all.vertices[row].normal);
  }
  for (const auto& quad : rows) {
    AppendTriangles({number[quad[0]], number[quad[1]], number[quad[2]], number[quad[3]]}, mesh);
  }
  return mesh;
}

}  // namespace covsplat
