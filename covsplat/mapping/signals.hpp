// What tracking knows about a point beyond its position: confidence and complexity.
#pragma once

#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/registration/preprocess.hpp"

namespace covsplat {

struct ConfidenceConfig {
  double range_m = 50.0;
  double min_cosine = 0.1;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("range_m", c.range_m, Range{1.0, 10000.0}, "r_0: confidence falls to 1/e here");
    v.Field("min_cosine",
            c.min_cosine,
            Range{0.0, 0.99},
            "c_0: no confidence at incidences flatter than this");
  }
};

/// Physical confidence u in [0, 1] of a measurement (paper eq. 7): certain near and head-on,
/// nothing far or grazing. `incidence_cosine` = |<normal, ray>|.
double PhysicalConfidence(double range_m, double incidence_cosine, const ConfidenceConfig& config);

/// Control score c in [0, 1] of each point (paper eq. 9): 0.55 linearity + 0.30 curvature + 0.15
/// registration residual, each normalised robustly over the scan. NaN where the point has no match
/// (an unknown residual is not a small one), or where too few have one to normalise by.
std::vector<float> ControlScores(std::span<const PointCovariance> covariance,
                                 std::span<const float> squared_distance);

}  // namespace covsplat
