// Feedback: the refined map becomes the next scans' registration target. The other place where
// mapping and tracking meet: Gaussians in, surfels with covariances and weights out.
#pragma once

#include <memory>
#include <optional>

#include "covsplat/mapping/gaussian_map.hpp"
#include "covsplat/registration/target.hpp"

namespace covsplat {

/// What tracking gets from mapping (the rows of the paper's table of mapping-to-tracking transfer).
enum class FeedbackMode {
  kFrozen,    ///< Gaussians as they were spawned: none is optimised
  kNoWeight,  ///< refined Gaussians, all matches alike
  kNoFilter,  ///< refined Gaussians, all of them
  kFull,      ///< refined Gaussians, the trackable ones, weighted
};

template <>
struct EnumNames<FeedbackMode> {
  static constexpr std::array<EnumName<FeedbackMode>, 4> kNames{
      {{FeedbackMode::kFrozen, "frozen"},
       {FeedbackMode::kNoWeight, "no_weight"},
       {FeedbackMode::kNoFilter, "no_filter"},
       {FeedbackMode::kFull, "full"}}};
};

/// By what matches with a Gaussian are weighted.
enum class MatchWeight {
  kScales,      ///< how round it is (paper eqs. 2, 3 and 5)
  kControl,     ///< how low its control score is, as in the paper's authors' code
  kConfidence,  ///< gamma = opacity * confidence
  kSupport,     ///< how many measurements it was made of
};

template <>
struct EnumNames<MatchWeight> {
  static constexpr std::array<EnumName<MatchWeight>, 4> kNames{
      {{MatchWeight::kScales, "scales"},
       {MatchWeight::kControl, "control"},
       {MatchWeight::kConfidence, "confidence"},
       {MatchWeight::kSupport, "support"}}};
};

struct FeedbackConfig {
  FeedbackMode mode = FeedbackMode::kFull;
  MatchWeight weight = MatchWeight::kSupport;
  int max_keyframe_age = 100;
  double min_opacity = 0.01;
  double min_confidence = 0.0;
  int max_seen_through = 0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("mode", c.mode, "what tracking gets from mapping");
    v.Field("weight", c.weight, "by what matches are weighted");
    v.Field("max_keyframe_age",
            c.max_keyframe_age,
            Range{1, 1000000},
            "Gaussians not seen for more keyframes than this are not tracked (k_min)");
    v.Field("min_opacity", c.min_opacity, Range{0.0, 1.0}, "alpha_min of trackable Gaussians");
    v.Field("min_confidence",
            c.min_confidence,
            Range{0.0, 1.0},
            "least gamma = opacity * confidence of trackable Gaussians");
    v.Field("max_seen_through",
            c.max_seen_through,
            Range{0, 1000000},
            "nor are those that more than so many keyframes in a row have seen through: what they "
            "show may have moved on");
  }
};

/// Gaussians with m_i = 1, k_i >= k_min and alpha_i >= alpha_min (paper eq. 1) within reach of a
/// pose that have not been seen through, with the weights that matches with them have. They are in
/// the frame of odometry, which is the map's own if `T_map_odom` is nothing, with positions
/// relative to the pose, rounded to metres.
std::shared_ptr<const RegistrationTarget> BuildTarget(const GaussianMap& map,
                                                      const std::optional<SE3>& T_map_odom,
                                                      const SE3& T_odom_sensor,
                                                      double reach_m,
                                                      const FeedbackConfig& config);

/// Weights of paper eqs. 2, 3 and 5 from in-plane scales `[N x 2]` in any order: 10 for round
/// surfels down to 1 for the most elongated. Curvature is normalised between its 5th and 95th
/// percentile, so a single needle does not make all others look planar.
std::vector<float> ScaleWeights(std::span<const Eigen::Vector2f> scales);

}  // namespace covsplat
