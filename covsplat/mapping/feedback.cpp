#include "covsplat/mapping/feedback.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/core/percentile.hpp"

namespace covsplat {
namespace {

constexpr float kEpsilon = 1e-3f;
constexpr float kMaxWeight = 10.0f;
/// Weights are relative; this much of the largest is left to Gaussians without any confidence.
constexpr float kMinWeight = 0.05f;
/// So many measurements give half of the weight that any number can give.
constexpr float kHalfSupport = 10.0f;

/// `x` in [0, 1], 0 is best (paper eq. 5).
float Preference(float x) { return std::min(1.0f / (x + kEpsilon), kMaxWeight); }

// Written so that NaN fails.
bool IsTrackable(const GaussianMap& map, std::size_t row, const FeedbackConfig& config) {
  const GaussianSignals& signals = map.Signals()[row];
  const float opacity = OpacityOf(map.Engine().Gaussians(), row);
  return signals.trackable && signals.last_seen >= map.Keyframes() - 1 - config.max_keyframe_age &&
         signals.seen_through <= config.max_seen_through &&
         opacity >= static_cast<float>(config.min_opacity) &&
         opacity * signals.confidence >= static_cast<float>(config.min_confidence);
}

/// Measurements that a Gaussian was made of.
float SupportOf(const GaussianSignals& signals, const TargetSurfel& surfel) {
  return std::max(1.0f, 12.0f * signals.density * surfel.scale0 * surfel.scale1);
}

/// Weight by what is known of the Gaussian alone.
float WeightOf(const GaussianMap& map,
               std::size_t row,
               const TargetSurfel& surfel,
               const FeedbackConfig& config) {
  const GaussianSignals& signals = map.Signals()[row];
  switch (config.weight) {
    case MatchWeight::kScales:
      break;  // by comparison with the others
    case MatchWeight::kControl:
      // Nothing known: neither preferred nor put back.
      return Preference(std::isnan(signals.control_score) ? 0.5f : signals.control_score);
    case MatchWeight::kConfidence:
      return std::max(OpacityOf(map.Engine().Gaussians(), row) * signals.confidence, kMinWeight);
    case MatchWeight::kSupport: {
      const float support = SupportOf(signals, surfel);
      return support / (support + kHalfSupport);
    }
  }
  return 1.0f;
}

/// Rows of a range as surfels relative to the origin, appended where trackable.
void AppendSurfels(const GaussianMap& map,
                   const AnchorRange& range,
                   const SE3& T_origin_anchor,
                   double reach_m,
                   const FeedbackConfig& config,
                   std::vector<TargetSurfel>& surfels) {
  const GaussianColumns<float>& table = map.Engine().Gaussians();
  const Eigen::Matrix3f rotation = T_origin_anchor.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_origin_anchor.Translation().cast<float>();
  const Eigen::Quaternionf q_origin_anchor = T_origin_anchor.Rotation().cast<float>();
  const auto reach = static_cast<float>(reach_m);
  const bool filters = config.mode != FeedbackMode::kNoFilter;
  const bool weighs = config.mode != FeedbackMode::kNoWeight;
  for (std::size_t i = range.begin; i < range.end; ++i) {
    if (filters && !IsTrackable(map, i, config)) continue;
    TargetSurfel surfel;
    surfel.mean = rotation * MeanOf(table, i) + translation;
    if (surfel.mean.squaredNorm() > reach * reach) continue;
    surfel.rotation = q_origin_anchor * RotationOf(table, i);
    surfel.scale0 = std::exp(table.Column(kLogScaleU)[i]);
    surfel.scale1 = std::exp(table.Column(kLogScaleV)[i]);
    if (!std::isfinite(surfel.scale0 + surfel.scale1)) continue;
    if (weighs) surfel.weight = WeightOf(map, i, surfel, config);
    surfels.push_back(surfel);
  }
}

void WeighByScales(std::vector<TargetSurfel>& surfels) {
  std::vector<Eigen::Vector2f> scales;
  scales.reserve(surfels.size());
  for (const TargetSurfel& surfel : surfels) scales.emplace_back(surfel.scale0, surfel.scale1);
  const std::vector<float> weights = ScaleWeights(scales);
  for (std::size_t i = 0; i < surfels.size(); ++i) surfels[i].weight = weights[i];
}

}  // namespace

std::shared_ptr<const RegistrationTarget> BuildTarget(const GaussianMap& map,
                                                      const std::optional<SE3>& T_map_odom,
                                                      const SE3& T_odom_sensor,
                                                      double reach_m,
                                                      const FeedbackConfig& config) {
  const Eigen::Vector3d origin_odom = T_odom_sensor.Translation().array().round();
  SE3 T_origin_map(Eigen::Quaterniond::Identity(), -origin_odom);
  if (T_map_odom) T_origin_map = T_origin_map * T_map_odom->Inverse();
  std::vector<TargetSurfel> surfels;
  for (const AnchorRange& range : map.Engine().Ranges()) {
    const SE3 T_origin_anchor = T_origin_map * map.KeyframePose(range.anchor);
    if (T_origin_anchor.Translation().norm() > 2.0 * reach_m) continue;
    AppendSurfels(map, range, T_origin_anchor, reach_m, config, surfels);
  }
  const bool by_scales =
      config.weight == MatchWeight::kScales && config.mode != FeedbackMode::kNoWeight;
  if (by_scales) WeighByScales(surfels);
  return std::make_shared<RegistrationTarget>(surfels, origin_odom, map.Keyframes());
}

std::vector<float> ScaleWeights(std::span<const Eigen::Vector2f> scales) {
  std::vector<float> kappa;
  kappa.reserve(scales.size());
  for (const Eigen::Vector2f& s : scales) {
    kappa.push_back(s.cwiseAbs().maxCoeff() / (s.cwiseAbs().minCoeff() + kEpsilon));
  }
  if (kappa.empty()) return kappa;
  std::vector<float> sorted = kappa;
  const float low = Percentile(sorted, 0.05);
  const float span = Percentile(sorted, 0.95) - low;
  for (float& value : kappa) {
    value = Preference(span > kEpsilon ? std::clamp((value - low) / span, 0.0f, 1.0f) : 0.0f);
  }
  return kappa;
}

}  // namespace covsplat
