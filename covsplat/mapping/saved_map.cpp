#include "covsplat/mapping/saved_map.hpp"

#include <cmath>

namespace covsplat {

void SavedMap::Resize(std::size_t size) {
  gaussians.Resize(size);
  confidence.resize(size, 0.0f);
  control_score.resize(size, -1.0f);
  intensity.resize(size, 0.0f);
  keyframe.resize(size, -1);
  last_seen.resize(size, -1);
}

SavedMap FlattenMap(const GaussianMap& map) {
  const GaussianColumns<float>& from = map.Engine().Gaussians();
  SavedMap saved;
  saved.Resize(map.Size());
  std::size_t row = 0;
  for (const AnchorRange& range : map.Engine().Ranges()) {
    const SE3& T_map_anchor = map.KeyframePose(range.anchor);
    for (std::size_t i = range.begin; i < range.end; ++i, ++row) {
      const Eigen::Vector3f mean = (T_map_anchor * MeanOf(from, i).cast<double>()).cast<float>();
      const Eigen::Quaternionf q =
          (T_map_anchor.Rotation() * RotationOf(from, i).cast<double>()).normalized().cast<float>();
      WriteGaussian(saved.gaussians,
                    row,
                    mean,
                    q,
                    {from.Column(kLogScaleU)[i], from.Column(kLogScaleV)[i]},
                    from.Column(kOpacityLogit)[i]);
      const GaussianSignals& signals = map.Signals()[i];
      const float score = signals.control_score;
      saved.confidence[row] = signals.confidence;
      saved.control_score[row] = std::isnan(score) ? -1.0f : score;
      saved.intensity[row] = signals.intensity;
      saved.keyframe[row] = range.anchor;
      saved.last_seen[row] = signals.last_seen;
    }
  }
  return saved;
}

SavedMap SelectRows(const SavedMap& map, std::span<const std::size_t> rows) {
  SavedMap chosen;
  chosen.Resize(rows.size());
  chosen.keyframes = map.keyframes;
  chosen.sensor = map.sensor;
  chosen.config_yaml = map.config_yaml;
  for (std::size_t to = 0; to < rows.size(); ++to) {
    const std::size_t from = rows[to];
    for (int p = 0; p < kParameterCount; ++p) {
      chosen.gaussians.Column(p)[to] = map.gaussians.Column(p)[from];
    }
    chosen.confidence[to] = map.confidence[from];
    chosen.control_score[to] = map.control_score[from];
    chosen.intensity[to] = map.intensity[from];
    chosen.keyframe[to] = map.keyframe[from];
    chosen.last_seen[to] = map.last_seen[from];
  }
  return chosen;
}

Eigen::Vector3f NormalOf(const GaussianColumns<float>& gaussians, std::size_t row) {
  return RotationOf(gaussians, row) * Eigen::Vector3f::UnitZ();
}

void SetRow(SavedMap& map,
            std::size_t row,
            const Eigen::Vector3f& mean,
            const Eigen::Quaternionf& rotation,
            const Eigen::Vector3f& log_scale,
            float opacity_logit) {
  // A turn that takes x to y to z cycles the axes until the thinnest is the third.
  const Eigen::Quaternionf cycle(0.5f, 0.5f, 0.5f, 0.5f);
  Eigen::Quaternionf q = rotation;
  Eigen::Vector3f scale = log_scale;
  for (int turn = 0; turn < 2 && scale.z() > scale.head<2>().minCoeff(); ++turn) {
    q = q * cycle;
    scale = Eigen::Vector3f(scale.y(), scale.z(), scale.x());
  }
  WriteGaussian(map.gaussians, row, mean, q, scale.head<2>(), opacity_logit);
}

}  // namespace covsplat
