#include "covsplat/eval/surface_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "covsplat/core/rng.hpp"
#include "covsplat/eval/voxel_index.hpp"

namespace covsplat {
namespace {

constexpr int kTileVoxels = 400;   // 8 m at 2 cm: the samples of a tile fit the cache
constexpr int kPieceVoxels = 100;  // longer triangles are cut, so that few pieces cross tiles

/// A triangle, or a part of one.
struct Piece {
  std::array<Eigen::Vector3f, 3> corner;
};

/// That a piece reaches into a tile.
struct Visit {
  std::uint64_t tile = 0;
  std::size_t piece = 0;

  bool operator<(const Visit& other) const {
    return std::tie(tile, piece) < std::tie(other.tile, other.piece);
  }
};

double AreaOf(const Piece& piece) {
  const Eigen::Vector3d a = piece.corner[0].cast<double>();
  const Eigen::Vector3d b = piece.corner[1].cast<double>() - a;
  const Eigen::Vector3d c = piece.corner[2].cast<double>() - a;
  return 0.5 * b.cross(c).norm();
}

Piece PieceOf(const TriangleMesh& mesh, const Eigen::Vector3i& triangle) {
  const auto corner = [&](int k) { return mesh.vertices[static_cast<std::size_t>(triangle[k])]; };
  return {{corner(0), corner(1), corner(2)}};
}

bool IsFinite(const Piece& piece) {
  return piece.corner[0].allFinite() && piece.corner[1].allFinite() && piece.corner[2].allFinite();
}

/// Halves the longest edge until all are short enough.
void Cut(const Piece& whole, float longest_m, std::vector<Piece>& pieces) {
  std::vector<Piece> left = {whole};
  while (!left.empty()) {
    const Piece piece = left.back();
    left.pop_back();
    std::size_t edge = 0;
    float length = 0.0f;
    for (std::size_t k = 0; k < 3; ++k) {
      const float here = (piece.corner[(k + 1) % 3] - piece.corner[k]).norm();
      if (here > length) std::tie(edge, length) = std::pair(k, here);
    }
    if (length <= longest_m) {
      pieces.push_back(piece);
      continue;
    }
    const std::size_t next = (edge + 1) % 3;
    Piece first = piece, second = piece;
    first.corner[next] = second.corner[edge] = 0.5f * (piece.corner[edge] + piece.corner[next]);
    left.push_back(first);
    left.push_back(second);
  }
}

std::vector<Piece> PiecesOf(const TriangleMesh& mesh, const SE3& T_world_mesh, double longest_m) {
  std::vector<Piece> pieces;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    Piece piece = PieceOf(mesh, triangle);
    if (!IsFinite(piece) || !(AreaOf(piece) > 0.0)) continue;
    for (Eigen::Vector3f& corner : piece.corner) {
      corner = (T_world_mesh * corner.cast<double>()).cast<float>();
    }
    Cut(piece, static_cast<float>(longest_m), pieces);
  }
  return pieces;
}

/// Every piece with every tile that its bounds touch, in order of tiles.
std::vector<Visit> VisitsOf(const std::vector<Piece>& pieces, double tile_m) {
  std::vector<Visit> visits;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto& [a, b, c] = pieces[i].corner;
    const auto cell = [&](const Eigen::Vector3f& p) -> Eigen::Vector3i {
      return (p.cast<double>() / tile_m).array().floor().cast<int>();
    };
    const Eigen::Vector3i low = cell(a.cwiseMin(b).cwiseMin(c));
    const Eigen::Vector3i high = cell(a.cwiseMax(b).cwiseMax(c));
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          visits.push_back({VoxelGrid::KeyOfCell({x, y, z}), i});
        }
      }
    }
  }
  std::sort(visits.begin(), visits.end());
  return visits;
}

/// Draws the samples of a piece and takes those inside the tile.
void SamplePiece(const Piece& piece,
                 std::uint64_t tile,
                 const VoxelGrid& tiles,
                 double per_m2,
                 Rng rng,
                 VoxelMeans& means) {
  const Eigen::Vector3d a = piece.corner[0].cast<double>();
  const Eigen::Vector3d ab = piece.corner[1].cast<double>() - a;
  const Eigen::Vector3d ac = piece.corner[2].cast<double>() - a;
  const auto count = static_cast<std::int64_t>(per_m2 * AreaOf(piece) + rng.Uniform());
  for (std::int64_t i = 0; i < count; ++i) {
    double u = rng.Uniform();
    double v = rng.Uniform();
    if (u + v > 1.0) std::tie(u, v) = std::pair(1.0 - u, 1.0 - v);
    const Eigen::Vector3d point = a + u * ab + v * ac;
    if (tiles.KeyOf(point) == tile) means.Add(point);
  }
}

}  // namespace

MeshCheck CheckMesh(const TriangleMesh& mesh) {
  MeshCheck check;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    const Piece piece = PieceOf(mesh, triangle);
    const bool finite = IsFinite(piece);
    const double area = finite ? AreaOf(piece) : 0.0;
    check.not_finite += !finite;
    check.no_area += finite && !(area > 0.0);
    check.area_m2 += area;
  }
  return check;
}

std::vector<Eigen::Vector3d> SampleMesh(const TriangleMesh& mesh,
                                        const SE3& T_world_mesh,
                                        const SamplingOptions& options,
                                        ThreadPool& pool) {
  const VoxelGrid tiles{kTileVoxels * options.voxel_m};
  const double per_m2 = options.samples_per_voxel / (options.voxel_m * options.voxel_m);
  const std::vector<Piece> pieces = PiecesOf(mesh, T_world_mesh, kPieceVoxels * options.voxel_m);
  const std::vector<Visit> visits = VisitsOf(pieces, tiles.edge_m);
  std::vector<std::size_t> first;  // visit of each tile
  for (std::size_t i = 0; i < visits.size(); ++i) {
    if (i == 0 || visits[i].tile != visits[i - 1].tile) first.push_back(i);
  }
  first.push_back(visits.size());

  std::vector<std::vector<Eigen::Vector3d>> points(first.size() - 1);
  ParallelFor(pool, points.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      VoxelMeans means({options.voxel_m});
      for (std::size_t i = first[t]; i < first[t + 1]; ++i) {
        const std::size_t k = visits[i].piece;
        SamplePiece(pieces[k], visits[i].tile, tiles, per_m2, Rng(options.seed, k), means);
      }
      points[t] = means.Means();
    }
  });
  std::vector<Eigen::Vector3d> all;
  for (std::vector<Eigen::Vector3d>& some : points) {
    all.insert(all.end(), some.begin(), some.end());
    std::vector<Eigen::Vector3d>().swap(some);
  }
  return all;
}

std::vector<Eigen::Vector3d> ThinPoints(std::span<const Eigen::Vector3d> points, double voxel_m) {
  VoxelMeans means({voxel_m});
  for (const Eigen::Vector3d& point : points) means.Add(point);
  return means.Means();
}

}  // namespace covsplat
