#include "apps/error_heatmap.hpp"

#include <span>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "covsplat/core/nearest_points.hpp"
#include "covsplat/io/output_file.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/report/colormap.hpp"
#include "covsplat/report/error_picture.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

PointTable ColouredPoints(std::span<const Eigen::Vector3d> points,
                          std::span<const float> errors_m,
                          double limit_m) {
  std::vector<float> x, y, z;
  std::vector<std::uint8_t> red, green, blue;
  for (std::size_t i = 0; i < points.size(); ++i) {
    x.push_back(static_cast<float>(points[i].x()));
    y.push_back(static_cast<float>(points[i].y()));
    z.push_back(static_cast<float>(points[i].z()));
    const Rgb color = DivergingColor(static_cast<double>(errors_m[i]) / limit_m);
    red.push_back(color.r);
    green.push_back(color.g);
    blue.push_back(color.b);
  }
  std::vector<float> errors(errors_m.begin(), errors_m.end());
  return {{{"x", std::move(x)},
           {"y", std::move(y)},
           {"z", std::move(z)},
           {"red", std::move(red)},
           {"green", std::move(green)},
           {"blue", std::move(blue)},
           {"error_m", std::move(errors)}},
          {fmt::format("distance to the truth; full red is {:g} m", limit_m)}};
}

Result<void> WriteColouredMesh(const HeatmapOptions& options,
                               const ComparedSurfaces& surfaces,
                               ThreadPool& pool) {
  const TriangleMesh& mesh = surfaces.result.mesh;
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    vertices.push_back(surfaces.T_truth_result * vertex.cast<double>());
  }
  const std::vector<float> errors_m =
      NearestPoints(surfaces.truth_points).DistancesFrom(vertices, pool);
  return WritePlyMesh(
      options.file, ColouredPoints(vertices, errors_m, options.limit_m), mesh.triangles);
}

/// The judged points of the truth and their errors.
std::pair<std::vector<Eigen::Vector3d>, std::vector<float>> JudgedTruth(
    const ComparedSurfaces& surfaces, const SurfaceDistances& distances) {
  std::pair<std::vector<Eigen::Vector3d>, std::vector<float>> judged;
  for (std::size_t i = 0; i < surfaces.truth_points.size(); ++i) {
    if (!surfaces.judged_truth.empty() && surfaces.judged_truth[i] == 0) continue;
    judged.first.push_back(surfaces.truth_points[i]);
    judged.second.push_back(distances.from_truth_m[i]);
  }
  return judged;
}

Result<void> WritePicture(const fs::path& path,
                          std::span<const Eigen::Vector3d> points,
                          std::span<const float> errors_m,
                          double limit_m) {
  if (points.empty()) return {};
  const auto png = EncodePng(DrawErrorsFromAbove(points, errors_m, limit_m));
  if (!png) return Forward(png);
  return WriteFileAtomically(path, {reinterpret_cast<const char*>(png->data()), png->size()});
}

}  // namespace

Result<void> CheckHeatmapFolder(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) return {};
  return Fail(ErrorCode::kOutput, "{}: there is no folder {}", file.string(), folder.string());
}

Result<std::vector<fs::path>> WriteHeatmap(const HeatmapOptions& options,
                                           const ComparedSurfaces& surfaces,
                                           const SurfaceDistances& distances,
                                           ThreadPool& pool) {
  const auto named = [&](const char* ending) {
    fs::path path = options.file;
    path.replace_filename(path.stem().string() + ending);
    return path;
  };
  const std::vector<fs::path> paths = {
      options.file, named("_accuracy.png"), named("_completeness.png")};
  const auto write_surface = [&] {
    if (surfaces.result.IsMesh()) return WriteColouredMesh(options, surfaces, pool);
    return WritePly(
        paths[0], ColouredPoints(surfaces.result_points, distances.from_result_m, options.limit_m));
  };
  const Result<void> written =
      write_surface()
          .and_then([&] {
            return WritePicture(
                paths[1], surfaces.result_points, distances.from_result_m, options.limit_m);
          })
          .and_then([&] {
            const auto [points, errors_m] = JudgedTruth(surfaces, distances);
            return WritePicture(paths[2], points, errors_m, options.limit_m);
          });
  if (!written) return Forward(written);
  return paths;
}

}  // namespace covsplat
