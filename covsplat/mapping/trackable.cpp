#include "covsplat/mapping/trackable.hpp"

#include <cmath>

namespace covsplat {
namespace {

// Confidence only changes relative weights; this much is left to Gaussians without any.
constexpr float kMinWeight = 0.05f;

/// Rows of a range as surfels relative to `origin_map`, appended where trackable.
void AppendSurfels(const GaussianMap& map,
                   const AnchorRange& range,
                   const SE3& T_origin_anchor,
                   double reach_m,
                   const TrackableConfig& config,
                   std::vector<TargetSurfel>& surfels) {
  const GaussianColumns<float>& table = map.Engine().Gaussians();
  const GaussianSignals& signals = map.Signals();
  const int oldest = map.Keyframes() - 1 - config.max_keyframe_age;
  const Eigen::Matrix3f rotation = T_origin_anchor.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_origin_anchor.Translation().cast<float>();
  const Eigen::Quaternionf q_origin_anchor = T_origin_anchor.Rotation().cast<float>();
  const auto reach = static_cast<float>(reach_m);
  for (std::size_t i = range.begin; i < range.end; ++i) {
    if (signals.trackable[i] == 0 || signals.last_seen[i] < oldest) continue;
    const float opacity = 1.0f / (1.0f + std::exp(-table.Column(kOpacityLogit)[i]));
    const float gamma = opacity * signals.confidence[i];
    // Written so that NaN fails.
    if (!(opacity >= static_cast<float>(config.min_opacity))) continue;
    if (!(gamma >= static_cast<float>(config.min_confidence))) continue;
    TargetSurfel surfel;
    surfel.mean = rotation * MeanOf(table, i) + translation;
    if (surfel.mean.squaredNorm() > reach * reach) continue;
    surfel.rotation = q_origin_anchor * RotationOf(table, i);
    surfel.scale0 = std::exp(table.Column(kLogScaleU)[i]);
    surfel.scale1 = std::exp(table.Column(kLogScaleV)[i]);
    if (config.weight_by_confidence) surfel.confidence = std::max(gamma, kMinWeight);
    surfels.push_back(surfel);
  }
}

}  // namespace

std::shared_ptr<const RegistrationTarget> BuildTarget(const GaussianMap& map,
                                                      const SE3& T_map_sensor,
                                                      double reach_m,
                                                      const TrackableConfig& config) {
  const Eigen::Vector3d origin_map = T_map_sensor.Translation().array().round();
  const SE3 T_origin_map(Eigen::Quaterniond::Identity(), -origin_map);
  std::vector<TargetSurfel> surfels;
  for (const AnchorRange& range : map.Engine().Ranges()) {
    const SE3 T_origin_anchor = T_origin_map * map.KeyframePose(range.anchor);
    if (T_origin_anchor.Translation().norm() > 2.0 * reach_m) continue;
    AppendSurfels(map, range, T_origin_anchor, reach_m, config, surfels);
  }
  return std::make_shared<RegistrationTarget>(surfels, origin_map, map.Keyframes());
}

}  // namespace covsplat
