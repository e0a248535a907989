// What tracking knows about a point beyond its position: confidence and complexity.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/registration/preprocess.hpp"

namespace covsplat {

/// What the map knows of a Gaussian beside its shape.
struct GaussianSignals {
  float confidence = 0.0f;                                        ///< u
  float control_score = std::numeric_limits<float>::quiet_NaN();  ///< c, NaN where unknown
  float density = 0.0f;    ///< measurements per m2 it was made of, 0: of one
  float intensity = 0.0f;  ///< mean of its measurements, 0 if scans have none
  int last_seen = -1;      ///< keyframe whose scan last agreed with the Gaussian (k_i)
  int seen_through = 0;    ///< keyframes since then that measured beyond it
  int splits = 0;          ///< times that it, or what it is a half of, was split
  bool trackable = false;  ///< m_i
};

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
