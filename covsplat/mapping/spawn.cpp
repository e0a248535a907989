#include "covsplat/mapping/spawn.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {
namespace {

/// Below this the surface is seen so flat that its sampling says little about its extent.
constexpr double kMinIncidence = 0.3;
/// A Gaussian is no wider than this many standard deviations of the surface around it.
constexpr double kSurfaceSigmas = 1.5;

struct Site {
  int row = 0;
  int column = 0;
};

bool IsExplained(const Keyframe& keyframe,
                 const RenderOutput* render,
                 Site site,
                 const SpawnConfig& config) {
  if (render == nullptr) return false;
  const double measured = keyframe.measurement.range_m(site.row, site.column);
  const double rendered = render->range_m(site.row, site.column);
  const double tolerance = config.range_tolerance_m + config.range_tolerance_ratio * measured;
  return render->alpha(site.row, site.column) >= config.max_alpha &&
         std::abs(rendered - measured) <= tolerance;
}

/// Foliage, edges and points in mid-air make poor discs: they are left to patches.
bool IsFlat(const PointCovariance& covariance) {
  constexpr float kMaxThicknessShare = 0.3f;
  const Eigen::Vector3f& sigma = covariance.sigma_m;
  return sigma[2] < kMaxThicknessShare * sigma[1];
}

/// Unexplained pixels on a known surface where no patch passes. `covered`: of the keyframe's
/// points, or empty if there are no patches.
std::vector<Site> FindBareSites(const Keyframe& keyframe,
                                const RenderOutput* render,
                                std::span<const std::uint8_t> covered,
                                const SpawnConfig& config) {
  std::vector<Site> sites;
  for (int row = 0; row < keyframe.point.Rows(); ++row) {
    for (int column = 0; column < keyframe.point.Columns(); ++column) {
      if (keyframe.surface(row, column) < 0) continue;
      if (IsExplained(keyframe, render, {row, column}, config)) continue;
      if (!covered.empty()) {
        const auto point = static_cast<std::size_t>(keyframe.point(row, column));
        const auto surface = static_cast<std::size_t>(keyframe.surface(row, column));
        if (covered[point] != 0 || !IsFlat(keyframe.tracked.covariance[surface])) continue;
      }
      sites.push_back({row, column});
    }
  }
  return sites;
}

/// Of bare sites the first in each voxel that is still empty.
std::vector<Site> ChooseSites(const Keyframe& keyframe,
                              const RenderOutput* render,
                              std::span<const Disc> existing_sensor,
                              std::span<const std::uint8_t> covered,
                              const SpawnConfig& config) {
  const auto cells_per_m = static_cast<float>(1.0 / config.voxel_m);
  VoxelHash cells;  // of the sites only, since they are few
  std::vector<Site> first;
  for (const Site& site : FindBareSites(keyframe, render, covered, config)) {
    const auto point = static_cast<std::size_t>(keyframe.point(site.row, site.column));
    const Eigen::Vector3i cell = CellOf(cells_per_m * keyframe.tracked.points[point]);
    const auto fresh = static_cast<int>(first.size());
    if (cells.FindOrInsert(cell, fresh) == fresh) first.push_back(site);
  }
  std::vector<std::uint8_t> taken(first.size(), 0);
  for (const Disc& disc : existing_sensor) {
    const int site = cells.Find(CellOf(cells_per_m * disc.mean));
    if (site >= 0) taken[static_cast<std::size_t>(site)] = 1;
  }
  std::size_t i = 0;
  std::erase_if(first, [&](const Site&) { return taken[i++] != 0; });
  return first;
}

/// A measured point moved along its surface's normal to the middle of the measurements around it:
/// that many times less of their noise is left.
Eigen::Vector3f OnSurface(const Keyframe& keyframe,
                          Site site,
                          const Eigen::Vector3f& normal,
                          const SpawnConfig& config) {
  constexpr int kRows = 2;
  constexpr int kColumns = 3;
  const auto reach = static_cast<float>(config.smoothing_radius_m);
  const auto band = static_cast<float>(config.smoothing_depth_m);
  const auto point_at = [&](int row, int column) {
    return keyframe.tracked.points[static_cast<std::size_t>(keyframe.point(row, column))];
  };
  const Eigen::Vector3f here = point_at(site.row, site.column);
  const int columns = keyframe.point.Columns();
  float sum = 0.0f;
  int count = 0;
  const int last_row = std::min(site.row + kRows, keyframe.point.Rows() - 1);
  for (int row = std::max(site.row - kRows, 0); row <= last_row; ++row) {
    for (int k = -kColumns; k <= kColumns; ++k) {
      const int column = (site.column + k + columns) % columns;
      if (keyframe.point(row, column) < 0) continue;
      const Eigen::Vector3f offset = point_at(row, column) - here;
      const float height = normal.dot(offset);
      if (std::abs(height) > band || offset.squaredNorm() > reach * reach) continue;
      sum += height;
      ++count;
    }
  }
  return count == 0 ? here : Eigen::Vector3f(here + sum / static_cast<float>(count) * normal);
}

/// Distance of neighbouring measurements on a surface, across the beams.
double SamplingDistance(const SensorModel& sensor, int row, double range, double cosine) {
  const std::vector<double>& elevation = sensor.Elevations();
  const auto upper = static_cast<std::size_t>(std::min(row, sensor.Rows() - 2));
  const double between_beams = elevation[upper] - elevation[upper + 1];
  const double between_columns = 2.0 * std::numbers::pi / sensor.Columns();
  return range * std::max(between_beams, between_columns) / std::max(cosine, kMinIncidence);
}

Eigen::Vector2d InitialScales(const SpawnConfig& config,
                              const Eigen::Vector3f& sigma,
                              double range,
                              double sampling_m) {
  Eigen::Vector2d scales;
  for (int k = 0; k < 2; ++k) {
    const double spread = sigma[k];
    // Paper eq. 6, or half way to the neighbours but not beyond the surface itself.
    const double wanted =
        config.scale_rule == ScaleRule::kPaper
            ? config.kappa * std::max(range, 1.0) * spread
            : std::min(config.spacing_factor * std::max(config.voxel_m, sampling_m),
                       kSurfaceSigmas * spread);
    scales[k] = std::clamp(wanted, config.min_scale_m, config.max_scale_m);
  }
  return scales;
}

/// The axes of a surface with the normal turned to face the sensor from `point`.
Eigen::Matrix3f FacingAxes(const Eigen::Matrix3f& axes, const Eigen::Vector3f& point) {
  Eigen::Matrix3f facing = axes;
  if (facing.col(2).dot(point) > 0.0f) {
    facing.col(1) *= -1.0f;
    facing.col(2) *= -1.0f;
  }
  return facing;
}

bool HasFixedScale(SpawnMode mode) {
  return mode == SpawnMode::kIdentity || mode == SpawnMode::kNoRangeScale;
}

bool HasFixedOpacity(SpawnMode mode) {
  return mode == SpawnMode::kIdentity || mode == SpawnMode::kNoOpacity;
}

/// Appends one Gaussian with its signals, as far as the mode lets it have them.
void Append(const Eigen::Vector3f& mean,
            const Eigen::Matrix3f& measured_axes,
            const Eigen::Vector2d& measured_scales,
            float control_score,
            float density,
            float intensity,
            const SpawnConfig& config,
            SpawnedGaussians& spawned) {
  const Eigen::Matrix3f axes = config.mode == SpawnMode::kIdentity
                                   ? FacingAxes(Eigen::Matrix3f::Identity(), mean)
                                   : measured_axes;
  const Eigen::Vector2d scales = HasFixedScale(config.mode)
                                     ? Eigen::Vector2d::Constant(config.fixed_scale_m)
                                     : measured_scales;
  const double cosine = std::abs(axes.col(2).dot(mean.normalized()));
  const double u = PhysicalConfidence(mean.norm(), cosine, config.confidence);
  // Paper eq. 8.
  const double share = HasFixedOpacity(config.mode) ? 0.5 : u;
  const double opacity = config.min_opacity + (config.max_opacity - config.min_opacity) * share;
  spawned.Add(mean,
              axes,
              {static_cast<float>(std::log(scales[0])), static_cast<float>(std::log(scales[1]))},
              static_cast<float>(std::log(opacity / (1.0 - opacity))),
              {.confidence = static_cast<float>(u),
               .control_score = control_score,
               .density = density,
               .intensity = intensity});
}

/// Control score of the surface that the keyframe shows in a pixel, NaN where it shows none.
float ControlScoreAt(const Keyframe& keyframe, const std::optional<Pixel>& pixel) {
  const int surface = pixel ? keyframe.surface(pixel->row, pixel->column) : -1;
  if (surface < 0) return std::numeric_limits<float>::quiet_NaN();
  return keyframe.control_score[static_cast<std::size_t>(surface)];
}

void SpawnFromPatches(const Keyframe& keyframe,
                      std::span<const Patch> patches,
                      const SensorModel& sensor,
                      const SpawnConfig& config,
                      SpawnedGaussians& spawned) {
  for (const Patch& patch : patches) {
    const std::optional<Pixel> pixel = sensor.Project(patch.mean);
    const Image<float>& measured_m = keyframe.measurement.range_m;
    if (pixel && SeesThrough(measured_m, *pixel, patch.mean.norm())) continue;
    const Eigen::Vector2d scales =
        (config.patches.extent_factor * patch.sigma_m.head<2>().cast<double>())
            .cwiseMax(config.min_scale_m)
            .cwiseMin(config.max_scale_m);
    const float score = ControlScoreAt(keyframe, pixel);
    Append(patch.mean, patch.axes, scales, score, patch.density, patch.intensity, config, spawned);
  }
}

void SpawnFromPixels(const Keyframe& keyframe,
                     std::span<const Site> sites,
                     const SensorModel& sensor,
                     const SpawnConfig& config,
                     SpawnedGaussians& spawned) {
  const std::vector<float>& intensity = keyframe.tracked.intensity;
  for (const Site& site : sites) {
    const auto surface = static_cast<std::size_t>(keyframe.surface(site.row, site.column));
    const auto point = static_cast<std::size_t>(keyframe.point(site.row, site.column));
    const PointCovariance& covariance = keyframe.tracked.covariance[surface];
    const Eigen::Vector3f mean = OnSurface(keyframe, site, covariance.axes.col(2), config);
    const double range = mean.norm();
    const double cosine = std::abs(covariance.axes.col(2).dot(mean.normalized()));
    const double sampling_m = SamplingDistance(sensor, site.row, range, cosine);
    Append(mean,
           FacingAxes(covariance.axes, mean),
           InitialScales(config, covariance.sigma_m, range, sampling_m),
           keyframe.control_score[surface],
           0.0f,
           intensity.empty() ? 0.0f : intensity[point],
           config,
           spawned);
  }
}

/// The keyframe's own points come last.
std::vector<PosedPoints> WithSweep(const Keyframe& keyframe) {
  const TrackedScan& tracked = keyframe.tracked;
  std::vector<PosedPoints> scans;
  scans.reserve(tracked.sweep.size() + 1);
  for (const SweptScan& scan : tracked.sweep) {
    scans.push_back({keyframe.ToMap(scan.T_odom_sensor), scan.points, scan.intensity});
  }
  scans.push_back({keyframe.PoseInMap(), tracked.points, tracked.intensity});
  return scans;
}

}  // namespace

void SpawnedGaussians::Add(const Eigen::Vector3f& mean,
                           const Eigen::Matrix3f& axes,
                           const Eigen::Vector2f& log_scale,
                           float opacity_logit,
                           const GaussianSignals& known) {
  const std::size_t i = gaussians.Size();
  gaussians.Resize(i + 1);
  const Eigen::Quaternionf rotation = Eigen::Quaternionf(axes).normalized();
  WriteGaussian(gaussians, i, mean, rotation, log_scale, opacity_logit);
  signals.push_back(known);
}

PatchFit FitPatches(const Keyframe& keyframe,
                    std::span<const Disc> existing_sensor,
                    const SensorModel& sensor,
                    const SpawnConfig& config,
                    ThreadPool& pool) {
  if (!config.patches.enabled) return {};
  return FitPatches(WithSweep(keyframe), existing_sensor, sensor, config.patches, pool);
}

SpawnedGaussians SpawnGaussians(const Keyframe& keyframe,
                                const PatchFit& fit,
                                const RenderOutput* render,
                                std::span<const Disc> existing_sensor,
                                const SensorModel& sensor,
                                const SpawnConfig& config) {
  SpawnedGaussians spawned;
  SpawnFromPatches(keyframe, fit.patches, sensor, config, spawned);
  const std::vector<Site> sites =
      ChooseSites(keyframe, render, existing_sensor, fit.covered, config);
  SpawnFromPixels(keyframe, sites, sensor, config, spawned);
  return spawned;
}

}  // namespace covsplat
