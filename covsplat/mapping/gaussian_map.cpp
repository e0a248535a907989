#include "covsplat/mapping/gaussian_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace covsplat {
namespace {

// A Gaussian is seen where its pixel's range agrees with its own to this much.
constexpr float kSeenToleranceM = 0.1f;
constexpr float kSeenToleranceRatio = 0.02f;

template <class T>
void Gather(std::vector<T>& column, const std::vector<std::size_t>& old_row) {
  std::vector<T> gathered(old_row.size());
  std::transform(
      old_row.begin(), old_row.end(), gathered.begin(), [&](std::size_t i) { return column[i]; });
  column = std::move(gathered);
}

}  // namespace

void GaussianSignals::Resize(std::size_t size) {
  confidence.resize(size, 0.0f);
  control_score.resize(size, std::numeric_limits<float>::quiet_NaN());
  density.resize(size, 0.0f);
  intensity.resize(size, 0.0f);
  last_seen.resize(size, -1);
  seen_through.resize(size, 0);
  trackable.resize(size, 0);
}

int GaussianMap::AddKeyframe(const Keyframe& keyframe, const SpawnedGaussians& spawned) {
  const int number = engine_->AddAnchor(keyframe.tracked.T_map_sensor);
  engine_->SetView(number, keyframe.measurement);
  if (spawned.gaussians.Size() == 0) return number;
  const AnchorRange range = engine_->Append(number, spawned.gaussians);
  signals_.Resize(engine_->Gaussians().Size());
  as_spawned_.Resize(engine_->Gaussians().Size());
  for (int p = 0; p < kParameterCount; ++p) {
    std::copy_n(
        spawned.gaussians.Column(p), spawned.gaussians.Size(), as_spawned_.Column(p) + range.begin);
  }
  for (std::size_t i = range.begin; i < range.end; ++i) {
    signals_.confidence[i] = spawned.confidence[i - range.begin];
    signals_.control_score[i] = spawned.control_score[i - range.begin];
    signals_.density[i] = spawned.density[i - range.begin];
    signals_.intensity[i] = spawned.intensity[i - range.begin];
    signals_.last_seen[i] = number;
    signals_.trackable[i] = 1;
  }
  return number;
}

void GaussianMap::MarkSeen(int keyframe_number,
                           const Keyframe& keyframe,
                           const SensorModel& sensor) {
  const GaussianColumns<float>& table = engine_->Gaussians();
  const SE3 T_sensor_map = keyframe.tracked.T_map_sensor.Inverse();
  for (const AnchorRange& range : engine_->Ranges()) {
    const SE3 T_sensor_anchor = T_sensor_map * KeyframePose(range.anchor);
    if (T_sensor_anchor.Translation().norm() > 2.0 * sensor.MaxRange()) continue;
    const Eigen::Matrix3f rotation = T_sensor_anchor.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_sensor_anchor.Translation().cast<float>();
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Eigen::Vector3f p = rotation * MeanOf(table, i) + translation;
      const std::optional<Pixel> pixel = sensor.Project(p);
      if (!pixel) continue;
      const float measured = keyframe.measurement.range_m(pixel->row, pixel->column);
      const float tolerance = kSeenToleranceM + kSeenToleranceRatio * measured;
      if (measured > 0.0f && std::abs(measured - p.norm()) < tolerance) {
        signals_.last_seen[i] = keyframe_number;
        signals_.seen_through[i] = 0;
      } else if (SeesThrough(keyframe, *pixel, p.norm())) {
        ++signals_.seen_through[i];
      }
    }
  }
}

/// Removes the rows that f(row) names; returns how many.
template <class F>
std::size_t GaussianMap::RemoveIf(F&& f) {
  std::vector<std::uint8_t> keep(engine_->Gaussians().Size(), 0);
  std::size_t removed = 0;
  for (const AnchorRange& range : engine_->Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      keep[i] = f(i) ? 0 : 1;
      removed += keep[i] == 0;
    }
  }
  if (removed == 0) return 0;
  const std::vector<std::size_t> old_row = engine_->Keep(keep);
  Gather(signals_.confidence, old_row);
  Gather(signals_.control_score, old_row);
  Gather(signals_.density, old_row);
  Gather(signals_.intensity, old_row);
  Gather(signals_.last_seen, old_row);
  Gather(signals_.seen_through, old_row);
  Gather(signals_.trackable, old_row);
  for (std::size_t i = 0; i < old_row.size(); ++i) as_spawned_.MoveRow(old_row[i], i);
  as_spawned_.Resize(old_row.size());
  return removed;
}

std::size_t GaussianMap::PruneOpacity(double min_opacity) {
  const auto min_logit = static_cast<float>(std::log(min_opacity / (1.0 - min_opacity)));
  const GaussianColumns<float>& table = engine_->Gaussians();
  return RemoveIf([&](std::size_t i) {
    bool finite = true;
    for (int p = 0; p < kParameterCount; ++p) finite &= std::isfinite(table.Column(p)[i]);
    return !finite || table.Column(kOpacityLogit)[i] < min_logit;
  });
}

std::size_t GaussianMap::PruneSeenThrough(int keyframes) {
  return RemoveIf([&](std::size_t i) { return signals_.seen_through[i] >= keyframes; });
}

NearGaussians GaussianMap::Near(const SE3& T_map_sensor, double distance_m) const {
  NearGaussians near;
  const GaussianColumns<float>& table = engine_->Gaussians();
  const auto limit = static_cast<float>(distance_m * distance_m);
  for (const AnchorRange& range : engine_->Ranges()) {
    const SE3 T_sensor_anchor = T_map_sensor.Inverse() * KeyframePose(range.anchor);
    if (T_sensor_anchor.Translation().norm() > 2.0 * distance_m) continue;
    const Eigen::Matrix3f rotation = T_sensor_anchor.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_sensor_anchor.Translation().cast<float>();
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Eigen::Vector3f mean = rotation * MeanOf(table, i) + translation;
      if (!(mean.squaredNorm() < limit)) continue;
      const Eigen::Matrix3f axes = rotation * RotationOf(table, i).normalized().toRotationMatrix();
      const Disc disc = {mean,
                         std::exp(table.Column(kLogScaleU)[i]) * axes.col(0),
                         std::exp(table.Column(kLogScaleV)[i]) * axes.col(1),
                         signals_.density[i]};
      if (!disc.u.allFinite() || !disc.v.allFinite()) continue;
      near.discs.push_back(disc);
      near.row.push_back(i);
    }
  }
  return near;
}

std::size_t GaussianMap::Remove(std::span<const std::size_t> rows) {
  std::vector<std::uint8_t> goes(engine_->Gaussians().Size(), 0);
  for (const std::size_t i : rows) goes[i] = 1;
  return RemoveIf([&](std::size_t i) { return goes[i] != 0; });
}

std::size_t GaussianMap::Size() const {
  std::size_t size = 0;
  for (const AnchorRange& range : engine_->Ranges()) size += range.end - range.begin;
  return size;
}

}  // namespace covsplat
