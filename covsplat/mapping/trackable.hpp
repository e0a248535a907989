// The trackable part of the map becomes the next scans' registration target. The other place where
// mapping and tracking meet: Gaussians in, surfels with covariances out.
#pragma once

#include <memory>

#include "covsplat/mapping/gaussian_map.hpp"
#include "covsplat/registration/target.hpp"

namespace covsplat {

struct TrackableConfig {
  int max_keyframe_age = 100;
  double min_opacity = 0.01;
  double min_confidence = 0.0;
  bool weight_by_confidence = false;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("max_keyframe_age",
            c.max_keyframe_age,
            Range{1, 1000000},
            "Gaussians not seen for more keyframes than this are not tracked (k_min)");
    v.Field("min_opacity", c.min_opacity, Range{0.0, 1.0}, "alpha_min of trackable Gaussians");
    v.Field("min_confidence",
            c.min_confidence,
            Range{0.0, 1.0},
            "least gamma = opacity * confidence of trackable Gaussians");
    v.Field("weight_by_confidence",
            c.weight_by_confidence,
            "weight matches by gamma = opacity * confidence");
  }
};

/// Gaussians with m_i = 1, k_i >= k_min and alpha_i >= alpha_min (paper eq. 1) within reach of a
/// pose. Positions are relative to the pose, rounded to metres.
std::shared_ptr<const RegistrationTarget> BuildTarget(const GaussianMap& map,
                                                      const SE3& T_map_sensor,
                                                      double reach_m,
                                                      const TrackableConfig& config);

}  // namespace covsplat
