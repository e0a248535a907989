#include "covsplat/eval/surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "covsplat/io/pcd.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/io/ply_header.hpp"
#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

constexpr double kMaxSamples = 1e9;    // about 6 GB of points
constexpr double kMaxCells = 1 << 20;  // that a grid reaches to either side
constexpr double kOddRatio = 100.0;
constexpr double kApart = 0.1;  // of the size of the truth

/// Only a file with faces is a mesh.
bool HasFaces(const PlyHeader& header) {
  return std::any_of(header.elements.begin(), header.elements.end(), [](const PlyElement& e) {
    return e.name == "face" && e.count > 0;
  });
}

Result<Surface> SurfaceOfMesh(TriangleMesh mesh, const std::string& file) {
  Surface surface;
  const MeshCheck check = CheckMesh(mesh);
  if (!(check.area_m2 > 0.0)) {
    return Fail(ErrorCode::kInput,
                "{}: none of its {} triangles has an area, so there is no surface",
                file,
                mesh.triangles.size());
  }
  if (check.not_finite > 0) {
    surface.remarks.push_back(fmt::format(
        "{}: {} triangles with corners that are not finite left out", file, check.not_finite));
  }
  if (check.no_area > 0) {
    surface.remarks.push_back(
        fmt::format("{}: {} triangles without area left out", file, check.no_area));
  }
  surface.mesh = std::move(mesh);
  return surface;
}

Result<Surface> SurfaceOfPoints(const PointTable& table, const std::string& file) {
  std::array<std::vector<double>, 3> axes;
  for (std::size_t k = 0; k < 3; ++k) {
    const char name = "xyz"[k];
    const PointColumn* column = table.Find(std::string_view(&name, 1));
    if (column == nullptr) return Fail(ErrorCode::kInput, "{}: its points have no {}", file, name);
    axes[k] = column->Doubles();
  }
  Surface surface;
  for (std::size_t i = 0; i < axes[0].size(); ++i) {
    const Eigen::Vector3d point(axes[0][i], axes[1][i], axes[2][i]);
    if (point.allFinite()) surface.points.push_back(point);
  }
  if (surface.points.empty()) {
    return Fail(ErrorCode::kInput, "{}: holds no finite points, so there is no surface", file);
  }
  const std::size_t left_out = axes[0].size() - surface.points.size();
  if (left_out > 0) {
    surface.remarks.push_back(
        fmt::format("{}: {} points that are not finite left out", file, left_out));
  }
  return surface;
}

Result<Surface> LoadPlySurface(const std::filesystem::path& path) {
  const std::string file = path.string();
  const Result<std::string> bytes = ReadFile(path);
  if (!bytes) return Forward(bytes);
  const Result<PlyHeader> header = ParsePlyHeader(*bytes, file);
  if (!header) return Forward(header);
  if (HasFaces(*header)) {
    Result<TriangleMesh> mesh = ParseTriangleMesh(*bytes, file);
    if (!mesh) return Forward(mesh);
    return SurfaceOfMesh(std::move(*mesh), file);
  }
  const Result<PointTable> table = ParsePly(*bytes, file);
  if (!table) return Forward(table);
  return SurfaceOfPoints(*table, file);
}

double DiagonalOf(const Eigen::AlignedBox3d& box) { return box.diagonal().norm(); }

std::string BoxText(const Eigen::AlignedBox3d& box) {
  return fmt::format("{:.4g} to {:.4g}, {:.4g} to {:.4g}, {:.4g} to {:.4g}",
                     box.min().x(),
                     box.max().x(),
                     box.min().y(),
                     box.max().y(),
                     box.min().z(),
                     box.max().z());
}

}  // namespace

Result<Surface> LoadSurface(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  if (extension == ".ply") return LoadPlySurface(path);
  if (extension == ".pcd") {
    const Result<PointTable> table = ReadPcd(path);
    if (!table) return Forward(table);
    return SurfaceOfPoints(*table, path.string());
  }
  return Fail(ErrorCode::kInput,
              "{}: surfaces are read from .ply (mesh or points) and .pcd (points) files",
              path.string());
}

Eigen::AlignedBox3d BoundsOf(const Surface& surface, const SE3& T_world_surface) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : surface.points) box.extend(T_world_surface * point);
  if (!surface.IsMesh()) return box;
  for (const Eigen::Vector3f& vertex : surface.mesh.vertices) {
    if (vertex.allFinite()) box.extend(T_world_surface * vertex.cast<double>());
  }
  return box;
}

Result<std::vector<Eigen::Vector3d>> PointsOf(const Surface& surface,
                                              const SE3& T_world_surface,
                                              const SamplingOptions& options,
                                              ThreadPool& pool) {
  const Eigen::AlignedBox3d box = BoundsOf(surface, T_world_surface);
  const double reach_m = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (reach_m >= (kMaxCells - 1.0) * options.voxel_m) {
    return Fail(ErrorCode::kInput,
                "a surface reaches {:.4g} m from the origin, beyond the grid of {:g} m voxels (at "
                "most {:.4g} m); is it in metres? Move it nearer or choose a larger --voxel",
                reach_m,
                options.voxel_m,
                kMaxCells * options.voxel_m);
  }
  if (surface.IsMesh()) {
    const double area_m2 = CheckMesh(surface.mesh).area_m2;
    const double samples =
        area_m2 * options.samples_per_voxel / (options.voxel_m * options.voxel_m);
    if (samples > kMaxSamples) {
      return Fail(ErrorCode::kInput,
                  "a surface of {:.4g} m^2 is too large for voxels of {:g} m; is it in metres? "
                  "Choose a larger --voxel",
                  area_m2,
                  options.voxel_m);
    }
    return SampleMesh(surface.mesh, T_world_surface, options, pool);
  }
  std::vector<Eigen::Vector3d> points;
  points.reserve(surface.points.size());
  for (const Eigen::Vector3d& point : surface.points) points.push_back(T_world_surface * point);
  return ThinPoints(points, options.voxel_m);
}

std::optional<std::string> OddBounds(const Eigen::AlignedBox3d& result,
                                     const Eigen::AlignedBox3d& truth) {
  const double ratio = DiagonalOf(result) / std::max(DiagonalOf(truth), 1e-12);
  if (ratio > kOddRatio || ratio < 1.0 / kOddRatio) {
    return fmt::format(
        "the result is {:.4g} m across and the truth {:.4g} m; is one of them in "
        "{}?",
        DiagonalOf(result),
        DiagonalOf(truth),
        std::max(ratio, 1.0 / ratio) > 300.0 ? "millimetres" : "other units");
  }
  if (result.exteriorDistance(truth) > kApart * DiagonalOf(truth)) {
    return fmt::format(
        "the result (x, y, z: {}) and the truth ({}) lie apart; are they in the same "
        "frame? --run and --recording move a run's map to the truth",
        BoxText(result),
        BoxText(truth));
  }
  return std::nullopt;
}

}  // namespace covsplat
