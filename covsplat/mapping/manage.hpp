// Map management: what keeps the map small, and fine where it has to be (the paper's map budget
// control).
#pragma once

#include "covsplat/mapping/gaussian_map.hpp"
#include "covsplat/mapping/plane_cover.hpp"

namespace covsplat {

/// What is done to the map beside removing what is wrong.
enum class ManageMode {
  kOpacity,  ///< nothing: only transparent Gaussians go
  kSplit,    ///< complex ones are split
  kPlane,    ///< planar ones are covered and pruned
  kFull,     ///< both
};

template <>
struct EnumNames<ManageMode> {
  static constexpr std::array<EnumName<ManageMode>, 4> kNames{{{ManageMode::kOpacity, "opacity"},
                                                               {ManageMode::kSplit, "split"},
                                                               {ManageMode::kPlane, "plane"},
                                                               {ManageMode::kFull, "full"}}};
};

struct SplitConfig {
  double control_quantile = 0.98;
  double min_opacity = 0.3;
  double min_scale_m = 0.1;
  double max_share = 0.0005;
  int max_splits = 2;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("control_quantile",
            c.control_quantile,
            Range{0.0, 1.0},
            "q_split: Gaussians with higher control scores than this share of them are split");
    v.Field("min_opacity", c.min_opacity, Range{0.0, 1.0}, "alpha_min of Gaussians to split");
    v.Field("min_scale_m", c.min_scale_m, Range{1e-3, 10.0}, "smaller Gaussians are not split");
    v.Field("max_share",
            c.max_share,
            Range{0.0, 1.0},
            "no more than this share is split at a time, the most complex first");
    v.Field("max_splits",
            c.max_splits,
            Range{1, 30},
            "halves are halved no more often, or the same ones would always be next");
  }
};

struct ManageConfig {
  ManageMode mode = ManageMode::kFull;
  bool feature_aware = true;
  int interval = 5;
  double prune_opacity = 0.05;
  int prune_seen_through = 2;
  PlaneCoverConfig plane;
  SplitConfig split;
  int max_gaussians = 0;
  double budget_mb = 0.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("mode", c.mode, "what is done beside pruning");
    v.Field("feature_aware",
            c.feature_aware,
            "control scores tell planar from complex Gaussians; off: all may be covered, and the "
            "largest are split (an ablation)");
    v.Field("interval", c.interval, Range{1, 100000}, "keyframes between two rounds");
    v.Field("prune_opacity",
            c.prune_opacity,
            Range{0.0, 0.9},
            "Gaussians that have become more transparent than this are removed");
    v.Field("prune_seen_through",
            c.prune_seen_through,
            Range{1, 1000000},
            "at once: Gaussians that so many keyframes in a row have seen through are removed");
    v.Section("plane", c.plane, "planar cover-and-prune");
    v.Section("split", c.split, "structure-aware splitting");
    v.Field("max_gaussians",
            c.max_gaussians,
            Range{0, 1000000000},
            "the map never has more after a round: those that show least go; 0: no limit");
    v.Field("budget_mb",
            c.budget_mb,
            Range{0.0, 1e6},
            "likewise for the memory of the Gaussians, with all that is kept of each; keyframes' "
            "views come on top; 0: no limit");
  }
};

/// Memory of a Gaussian: as it is and as it was spawned, the optimiser's, and its signals.
inline constexpr std::size_t kBytesPerGaussian =
    sizeof(float) * (2 * kParameterCount + kMomentCount) + sizeof(GaussianSignals);

/// One round around a pose: prunes by opacity, covers planes that hold Gaussians of
/// `first_keyframe` or later ones, splits, and keeps the map within its limits. `extent_factor`:
/// scale of a Gaussian in standard deviations of what it stands for (PatchConfig).
void ManageMap(GaussianMap& map,
               const SE3& T_map_sensor,
               double reach_m,
               int first_keyframe,
               double extent_factor,
               const ManageConfig& config);

/// Surfaces that several keyframes hold, now that they lie upon each other, are covered by one.
void JoinSurfaces(GaussianMap& map,
                  const SE3& T_map_sensor,
                  double reach_m,
                  double extent_factor,
                  const ManageConfig& config);

}  // namespace covsplat
