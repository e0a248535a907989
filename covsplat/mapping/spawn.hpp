// Spawning: the part of a keyframe that the map does not explain becomes new Gaussians. One of the
// two places where tracking and mapping meet: covariances in, Gaussians out.
#pragma once

#include <optional>

#include "covsplat/mapping/keyframe.hpp"
#include "covsplat/mapping/patches.hpp"
#include "covsplat/mapping/signals.hpp"

namespace covsplat {

/// How large a new Gaussian is.
enum class ScaleRule {
  kSpacing,  ///< half the distance to its neighbours: the sampling of the scan, or the spawn voxel
  kPaper,    ///< kappa * range * sigma of the local covariance (paper eq. 6)
};

template <>
struct EnumNames<ScaleRule> {
  static constexpr std::array<EnumName<ScaleRule>, 2> kNames{
      {{ScaleRule::kSpacing, "spacing"}, {ScaleRule::kPaper, "paper"}}};
};

/// What new Gaussians take from tracking (the rows of the paper's table of tracking-to-mapping
/// transfer).
enum class SpawnMode {
  kIdentity,      ///< nothing but positions
  kNoRangeScale,  ///< orientation and opacity; all of the same size
  kNoOpacity,     ///< orientation and size; all of the same opacity
  kFull,          ///< orientation and size from covariances, opacity from the confidence
};

template <>
struct EnumNames<SpawnMode> {
  static constexpr std::array<EnumName<SpawnMode>, 4> kNames{
      {{SpawnMode::kIdentity, "identity"},
       {SpawnMode::kNoRangeScale, "no_range_scale"},
       {SpawnMode::kNoOpacity, "no_opacity"},
       {SpawnMode::kFull, "full"}}};
};

struct SpawnConfig {
  SpawnMode mode = SpawnMode::kFull;
  double voxel_m = 0.3;
  double max_alpha = 0.5;
  double range_tolerance_m = 0.1;
  double range_tolerance_ratio = 0.01;
  double smoothing_radius_m = 0.3;
  double smoothing_depth_m = 0.1;
  ScaleRule scale_rule = ScaleRule::kSpacing;
  double spacing_factor = 0.5;
  double kappa = 0.1;
  double min_scale_m = 0.02;
  double max_scale_m = 0.5;
  double fixed_scale_m = 0.1;
  double min_opacity = 0.4;
  double max_opacity = 0.9;
  PatchConfig patches;
  ConfidenceConfig confidence;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("mode", c.mode, "what new Gaussians take from tracking");
    v.Field(
        "voxel_m", c.voxel_m, Range{0.02, 5.0}, "at most one new Gaussian per cube of this size");
    v.Field("max_alpha",
            c.max_alpha,
            Range{0.0, 1.0},
            "pixels rendered less opaque than this are not explained by the map");
    v.Field("range_tolerance_m",
            c.range_tolerance_m,
            Range{0.0, 10.0},
            "nor are pixels whose range is off by more than this ...");
    v.Field("range_tolerance_ratio",
            c.range_tolerance_ratio,
            Range{0.0, 1.0},
            "... plus this share of the range");
    v.Field("smoothing_radius_m",
            c.smoothing_radius_m,
            Range{0.0, 5.0},
            "a new Gaussian lies in the middle of the measurements around it as far as this ...");
    v.Field("smoothing_depth_m",
            c.smoothing_depth_m,
            Range{0.0, 1.0},
            "... and this near to its plane; 0: where its own measurement was");
    v.Field("scale_rule", c.scale_rule, "size of new Gaussians");
    v.Field("spacing_factor",
            c.spacing_factor,
            Range{0.05, 5.0},
            "spacing rule: scale in units of the distance to the neighbours");
    v.Field("kappa", c.kappa, Range{1e-3, 10.0}, "paper rule: kappa");
    v.Field("min_scale_m", c.min_scale_m, Range{1e-3, 1.0}, "smallest initial scale");
    v.Field("max_scale_m", c.max_scale_m, Range{0.01, 10.0}, "s_max: largest initial scale");
    v.Field("fixed_scale_m",
            c.fixed_scale_m,
            Range{1e-3, 10.0},
            "scale where all have the same (modes identity and no_range_scale)");
    v.Field("min_opacity", c.min_opacity, Range{0.001, 0.999}, "initial opacity at confidence 0");
    v.Field("max_opacity", c.max_opacity, Range{0.001, 0.999}, "initial opacity at confidence 1");
    v.Section("patches", c.patches, "planes through the scans since the last keyframe");
    v.Section("confidence", c.confidence, "physical confidence u");
  }
};

/// New Gaussians in the keyframe's frame with the signals that come from tracking.
struct SpawnedGaussians {
  GaussianColumns<float> gaussians;
  std::vector<GaussianSignals> signals;  ///< [N]

  void Add(const Eigen::Vector3f& mean,
           const Eigen::Matrix3f& axes,
           const Eigen::Vector2f& log_scale,
           float opacity_logit,
           const GaussianSignals& known);
};

/// Patches through all scans since the last keyframe where they lie dense enough; nothing if
/// patches are off. `existing_sensor`: the map's Gaussians around the keyframe, in its frame; those
/// that the fit says it replaces should go before anything is spawned.
PatchFit FitPatches(const Keyframe& keyframe,
                    std::span<const Disc> existing_sensor,
                    const SensorModel& sensor,
                    const SpawnConfig& config,
                    ThreadPool& pool);

/// A Gaussian per patch, and elsewhere the keyframe's own pixels with the covariances that tracking
/// has of them. `render`: the map from the keyframe's pose; nothing for the first keyframe.
/// `existing_sensor`: as above, without what was replaced. A voxel that has a mean gets no second
/// pixel, however badly it is explained (edges and foliage never are).
SpawnedGaussians SpawnGaussians(const Keyframe& keyframe,
                                const PatchFit& fit,
                                const RenderOutput* render,
                                std::span<const Disc> existing_sensor,
                                const SensorModel& sensor,
                                const SpawnConfig& config);

}  // namespace covsplat
