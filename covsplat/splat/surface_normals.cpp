#include "covsplat/splat/surface_normals.hpp"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace covsplat {
namespace {

struct Sampler {
  const ViewGeometry<float>& view;
  const TileImages<float>& images;
  float min_alpha;

  /// Rendered range of a pixel; 0 where there is none. Columns wrap.
  float Range(int row, int column) const {
    if (row < 0 || row >= view.rows) return 0.0f;
    const std::size_t i = PixelIndex(view, row, Wrap(column));
    const float alpha = 1.0f - images.transmittance[i];
    if (alpha < min_alpha) return 0.0f;
    const float expected = images.range_sum[i] / alpha;
    return expected + view.depth_ratio * (images.median[i] - expected);
  }

  Eigen::Vector3f Point(int row, int column, float range) const {
    column = Wrap(column);
    const auto x = kTilePixels * static_cast<std::size_t>(column / kTileSide) +
                   static_cast<std::size_t>(column % kTileSide);
    const auto y = kTilePixels * static_cast<std::size_t>(row / kTileSide) +
                   static_cast<std::size_t>(kTileSide * (row % kTileSide));
    const float cos_el = view.cos_elevation[y];
    return range * Eigen::Vector3f(cos_el * view.cos_azimuth[x],
                                   cos_el * view.sin_azimuth[x],
                                   view.sin_elevation[y]);
  }

  Eigen::Vector3f Normal(int row, int column) const {
    const float centre = Range(row, column);
    if (centre <= 0.0f) return Eigen::Vector3f::Zero();
    const float left = Range(row, column - 1);
    const float right = Range(row, column + 1);
    const float up = Range(row - 1, column);
    const float down = Range(row + 1, column);
    for (const float neighbour : {left, right, up, down}) {
      if (!(std::abs(neighbour - centre) < kMaxRelativeStep * centre)) {
        return Eigen::Vector3f::Zero();
      }
    }
    const Eigen::Vector3f across = Point(row, column + 1, right) - Point(row, column - 1, left);
    const Eigen::Vector3f along = Point(row + 1, column, down) - Point(row - 1, column, up);
    const Eigen::Vector3f normal = along.cross(across).normalized();
    return normal.dot(Point(row, column, centre)) < 0.0f ? normal : Eigen::Vector3f(-normal);
  }

  int Wrap(int column) const {
    return column < 0               ? column + view.columns
           : column >= view.columns ? column - view.columns
                                    : column;
  }
};

}  // namespace

void FindSurfaceNormals(const ViewGeometry<float>& view,
                        const TileImages<float>& images,
                        double min_alpha,
                        ThreadPool& pool,
                        TileTargets<float>& targets) {
  const Sampler sampler{view, images, static_cast<float>(min_alpha)};
  ParallelFor(
      pool, static_cast<std::size_t>(view.rows), 4, [&](std::size_t begin, std::size_t end) {
        for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
          for (int column = 0; column < view.columns; ++column) {
            const std::size_t i = PixelIndex(view, row, column);
            if (targets.range_m[i] <= 0.0f) continue;
            const Eigen::Vector3f normal = sampler.Normal(row, column);
            targets.surface_x[i] = normal.x();
            targets.surface_y[i] = normal.y();
            targets.surface_z[i] = normal.z();
          }
        }
      });
}

}  // namespace covsplat
