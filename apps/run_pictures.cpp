#include "apps/run_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "covsplat/report/colormap.hpp"
#include "covsplat/report/map_picture.hpp"

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kPanoramas = 3;
constexpr int kPanoramaColumns = 1024;

/// The sensor's field of view with square pixels.
SensorModel PanoramaModel(const SensorModel& sensor) {
  const double top = sensor.Elevations().front();
  const double bottom = sensor.Elevations().back();
  const double rows = (top - bottom) / (2.0 * kPi / kPanoramaColumns);
  return UniformSensorModel(std::clamp(static_cast<int>(rows), 16, 512),
                            kPanoramaColumns,
                            bottom,
                            top,
                            sensor.MinRange(),
                            sensor.MaxRange());
}

/// Ranges 5 % and 95 % of what is seen.
std::pair<double, double> RangeLimits(const Image<float>& range_m) {
  std::vector<float> seen;
  for (const float r : range_m.Pixels()) {
    if (r > 0.0f) seen.push_back(r);
  }
  if (seen.empty()) return {1.0, 10.0};
  std::sort(seen.begin(), seen.end());
  const double near_m = static_cast<double>(seen[seen.size() / 20]);
  const double far_m = static_cast<double>(seen[seen.size() * 19 / 20]);
  return {near_m, std::max(far_m, 1.1 * near_m)};
}

/// Ranges over normals, with a seam.
Image<Rgb> Panorama(const RenderOutput& view, const SE3& T_map_sensor) {
  constexpr int kSeam = 4;
  const int rows = view.range_m.Rows();
  const int columns = view.range_m.Columns();
  const auto [near_m, far_m] = RangeLimits(view.range_m);
  const Image<Rgb> range = ColorizeRange(view.range_m, near_m, far_m);
  const Eigen::Matrix3f R_map_sensor = T_map_sensor.RotationMatrix().cast<float>();
  Image<Rgb> picture(2 * rows + kSeam, columns, kNoDataColor);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      picture(i, j) = range(i, j);
      picture(i + rows + kSeam, j) = NormalColor(R_map_sensor * view.normal(i, j));
    }
  }
  return picture;
}

/// The map rendered at a few poses along the path, finer than the sensor.
void AddPanoramas(SlamSystem& system,
                  const SlamConfig& config,
                  const RunResults& results,
                  std::vector<MapPicture>& pictures) {
  ThreadPool pool(config.system.threads);
  const GaussianMap& map = system.GetMapper().Map();
  const auto engine = CopyEngine(map,
                                 map.Engine().Gaussians(),
                                 config.system.backend,
                                 PanoramaModel(system.Sensor()),
                                 config.mapper.engine,
                                 pool);
  if (!engine) return;
  const std::size_t count = results.records.size();
  for (std::size_t i = 0; i < kPanoramas && i < count; ++i) {
    const ScanRecord& record = results.records[(2 * i + 1) * count / (2 * kPanoramas)];
    const RenderOutput view = (*engine)->Render(record.T_map_sensor);
    pictures.push_back({fmt::format("Rendered at scan {}: range (near is bright) and normals, the "
                                    "full turn, forward in the middle",
                                    record.scan),
                        Panorama(view, record.T_map_sensor)});
  }
}

}  // namespace

std::vector<MapPicture> DrawMap(SlamSystem& system,
                                const SlamConfig& config,
                                const SavedMap& saved,
                                const RunResults& results) {
  std::vector<MapPicture> pictures;
  if (saved.Size() == 0) return pictures;
  std::vector<Eigen::Vector3d> path;
  for (const ScanRecord& r : results.records) path.push_back(r.T_map_sensor.Translation());
  MapView above;
  pictures.push_back(
      {"From above: brighter is higher; the path in red. Surfaces that face down "
       "(ceilings) are left out.",
       DrawMapView(saved, path, above)});
  MapView oblique;
  oblique.R_view_map = (Eigen::AngleAxisd(-kPi / 3.2, Eigen::Vector3d::UnitX()) *
                        Eigen::AngleAxisd(kPi / 6.0, Eigen::Vector3d::UnitZ()))
                           .toRotationMatrix();
  pictures.push_back({"From the side", DrawMapView(saved, path, oblique)});
  AddPanoramas(system, config, results, pictures);
  return pictures;
}

}  // namespace covsplat
