// Planar cover-and-prune: Gaussians of one plane, side by side or upon each other, give way to one
// that covers what they covered.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/mapping/patches.hpp"

namespace covsplat {

struct PlaneCoverConfig {
  double control_quantile = 0.98;
  double min_opacity = 0.3;
  double cell_m = 0.8;
  int passes = 3;
  double max_angle_deg = 40.0;
  double flatness_m = 0.015;
  double fill = 0.5;
  double cover = 0.98;
  double max_scale_m = 0.2;
  double max_share = 0.5;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("control_quantile",
            c.control_quantile,
            Range{0.0, 1.0},
            "q_plane: the share with the lowest control scores is taken for planar");
    v.Field("min_opacity", c.min_opacity, Range{0.0, 1.0}, "alpha_min of Gaussians to cover");
    v.Field("cell_m", c.cell_m, Range{0.05, 10.0}, "Gaussians of one such cell can become one");
    v.Field("passes",
            c.passes,
            Range{1, 6},
            "passes over cells of twice the size each time, the last over those of cell_m");
    v.Field("max_angle_deg", c.max_angle_deg, Range{0.0, 90.0}, "normals differ by no more");
    v.Field("flatness_m",
            c.flatness_m,
            Range{1e-4, 1.0},
            "nor do they lie farther from their common plane (root mean square)");
    v.Field("fill",
            c.fill,
            Range{0.0, 1.0},
            "they fill at least this share of the Gaussian that covers them");
    v.Field("cover",
            c.cover,
            Range{0.0, 1.0},
            "q_cover: it is made so large that this share of them lies within");
    v.Field("max_scale_m",
            c.max_scale_m,
            Range{0.01, 10.0},
            "it gets no larger than this, or, of larger ones upon each other, than the largest");
    v.Field("max_share",
            c.max_share,
            Range{0.0, 1.0},
            "a pass removes no more than this share, the most redundant first");
  }
};

/// A Gaussian that may be covered.
struct PlanarGaussian {
  Disc disc;
  float opacity = 0.0f;
};

/// One Gaussian instead of several.
struct PlaneCover {
  std::vector<std::size_t> members;  ///< two at least, ascending
  Disc disc;                         ///< u x v points to the members' common side
  float opacity = 0.0f;
};

/// Finds what can be covered (the paper's map budget control, with moments instead of projections).
/// A cover has the moments of its members taken as evenly filled rectangles, whose half sides are
/// sqrt(3) / `extent_factor` scales, and is then expanded to cover them; so it lies in the middle
/// of them, and joining the halves of a Gaussian gives the whole again. The same result for the
/// same Gaussians in the same order.
std::vector<PlaneCover> CoverPlanes(std::span<const PlanarGaussian> gaussians,
                                    double extent_factor,
                                    const PlaneCoverConfig& config);

}  // namespace covsplat
