// Configuration of rendering, losses and the optimiser.
#pragma once

#include "covsplat/core/config_field.hpp"

namespace covsplat {

/// How Gaussians become images (algorithm: rays against flat Gaussians, front to back).
struct RasterConfig {
  double near_m = 0.1;
  double alpha_min = 0.02;
  double alpha_cap = 0.99;
  double transmittance_min = 0.03;
  double lowpass = 2.0;
  double grazing_cosine = 0.02;
  bool two_sided = false;
  double depth_ratio = 0.5;
  int rebin_interval = 10;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("near_m", c.near_m, Range{1e-3, 10.0}, "Gaussians nearer than this are not drawn");
    v.Field("alpha_min", c.alpha_min, Range{1e-12, 0.1}, "contributions below this are left out");
    v.Field(
        "alpha_cap", c.alpha_cap, Range{0.5, 0.9999}, "one Gaussian never hides more than this");
    v.Field("transmittance_min",
            c.transmittance_min,
            Range{1e-12, 0.1},
            "a ray stops when less than this is left of it");
    v.Field("lowpass",
            c.lowpass,
            Range{0.1, 10.0},
            "screen-space filter: smallest footprint has a standard deviation of "
            "1/sqrt(lowpass) pixels");
    v.Field("grazing_cosine",
            c.grazing_cosine,
            Range{0.0, 0.2},
            "rays flatter than this to a Gaussian only see its screen-space filter");
    v.Field("two_sided",
            c.two_sided,
            "draw Gaussians from behind as well; off: only from the side they were measured from");
    v.Field("depth_ratio",
            c.depth_ratio,
            Range{0.0, 1.0},
            "rendered range: 0 expected, 1 median, between: mixed");
    v.Field("rebin_interval",
            c.rebin_interval,
            Range{1, 100},
            "optimiser steps on one view between two sorts of the Gaussians into tiles");
  }
};

/// Weights of the terms of the mapping loss (paper eqs. 10 to 13).
struct LossConfig {
  double range_cap_m = 0.3;
  double opacity = 0.03;
  double opacity_epsilon = 1e-2;
  double gicp_normal = 0.05;
  double surface_normal = 0.01;
  int surface_normal_start = 100;
  double scale = 10.0;
  double max_scale_m = 0.5;
  double min_alpha = 0.1;
  double hidden_margin_m = 0.3;
  double hidden_margin_ratio = 0.03;
  bool through_filter = false;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("range_cap_m",
            c.range_cap_m,
            Range{1e-3, 1e6},
            "a ray that ends farther than this from the measurement counts no more than this");
    v.Field(
        "opacity", c.opacity, Range{0.0, 100.0}, "lambda_alpha: pixels with a return are opaque");
    v.Field("opacity_epsilon",
            c.opacity_epsilon,
            Range{1e-6, 1.0},
            "epsilon in -log(A + epsilon); bounds the gradient of uncovered pixels");
    v.Field("gicp_normal",
            c.gicp_normal,
            Range{0.0, 100.0},
            "lambda_n,g: rendered normals follow the scan's covariances");
    v.Field("surface_normal",
            c.surface_normal,
            Range{0.0, 100.0},
            "lambda_n,s: rendered normals follow the rendered surface");
    v.Field("surface_normal_start",
            c.surface_normal_start,
            Range{0, 1000000},
            "optimiser steps before the surface-normal term sets in");
    v.Field("scale", c.scale, Range{0.0, 1000.0}, "lambda_s: no scale beyond max_scale_m");
    v.Field("max_scale_m", c.max_scale_m, Range{0.01, 10.0}, "s_max of the scale term");
    v.Field("min_alpha",
            c.min_alpha,
            Range{1e-4, 1.0},
            "range and normal terms need at least this rendered opacity");
    v.Field("hidden_margin_m",
            c.hidden_margin_m,
            Range{0.0, 1e6},
            "Gaussians farther than this behind a measurement ...");
    v.Field("hidden_margin_ratio",
            c.hidden_margin_ratio,
            Range{0.0, 1.0},
            "... plus this share of the range are not changed by it: its ray has not been there, "
            "and what shines through an incomplete surface shall not fade for that");
    v.Field("through_filter",
            c.through_filter,
            "Gaussians also change for rays that meet no more of them than their screen-space "
            "filter; off: they are smaller than the pixel, their range says little of its middle");
  }
};

/// Adam with one second moment per vector, so that updates do not depend on the anchor's axes.
struct OptimizerConfig {
  double mean_step_m = 2e-5;
  double rotation_step_rad = 3e-4;
  double log_scale_step = 5e-3;
  double opacity_logit_step = 5e-2;
  double beta1 = 0.9;
  double beta2 = 0.999;
  double epsilon = 1e-15;
  bool mean_along_normal = true;
  double max_growth = 2.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("mean_step_m", c.mean_step_m, Range{0.0, 1.0}, "learning rate of means");
    v.Field(
        "rotation_step_rad", c.rotation_step_rad, Range{0.0, 1.0}, "learning rate of rotations");
    v.Field("log_scale_step", c.log_scale_step, Range{0.0, 1.0}, "learning rate of log scales");
    v.Field("opacity_logit_step",
            c.opacity_logit_step,
            Range{0.0, 10.0},
            "learning rate of opacity logits");
    v.Field("beta1", c.beta1, Range{0.0, 0.9999}, "decay of the first moment");
    v.Field("beta2", c.beta2, Range{0.0, 0.99999}, "decay of the second moment");
    v.Field("epsilon", c.epsilon, Range{1e-30, 1.0}, "added to the root of the second moment");
    v.Field(
        "mean_along_normal",
        c.mean_along_normal,
        "means move along their normals only: sideways motion of a surfel is hardly observable");
    v.Field("max_growth",
            c.max_growth,
            Range{1.0, 1e6},
            "a Gaussian becomes no more than so many times as wide as it was spawned: that was "
            "measured, while rays leave open what is between them");
  }
};

}  // namespace covsplat
