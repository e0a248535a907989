#include "covsplat/mapping/gaussian_map.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
int GaussianMap::AddKeyframe(const Keyframe& keyframe, const SpawnedGaussians& spawned) {
  const int number = engine_->AddAnchor(keyframe.PoseInMap());
  engine_->SetView(number, keyframe.measurement);
  SpawnedGaussians seen = spawned;
  for (GaussianSignals& signals : seen.signals) {
    signals.last_seen = number;
    signals.trackable = true;
  }
  Append(number, seen);
  return number;
}

void GaussianMap::Append(int keyframe, const SpawnedGaussians& fresh) {
  const std::size_t size = fresh.gaussians.Size();
  if (size == 0) return;
  const std::size_t begin = engine_->Append(keyframe, fresh.gaussians).begin;
  ResizeTightly(signals_, engine_->Gaussians().Size());
  as_spawned_.Resize(engine_->Gaussians().Size());
  for (int p = 0; p < kParameterCount; ++p) {
    std::copy_n(fresh.gaussians.Column(p), size, as_spawned_.Column(p) + begin);
  }
  std::ranges::copy(fresh.signals, signals_.begin() + static_cast<std::ptrdiff_t>(begin));
}

std::vector<std::size_t> GaussianMap::MarkSeen(int keyframe_number,
                                               const Keyframe& keyframe,
                                               const SensorModel& sensor,
                                               int max_age) {
  constexpr double kLiesAsItDid = 0.95;
  constexpr float kSameSurfaceM = 0.1f;
  const int oldest_known = keyframe_number - max_age;
  std::vector<std::size_t> there;
  std::vector<std::size_t> through;
  std::size_t old_there = 0;
  const auto is_old = [&](std::size_t i) { return signals_[i].last_seen < oldest_known; };
  const GaussianColumns<float>& table = engine_->Gaussians();
  const SE3 T_sensor_map = keyframe.PoseInMap().Inverse();
  for (const AnchorRange& range : engine_->Ranges()) {
    const SE3 T_sensor_anchor = T_sensor_map * KeyframePose(range.anchor);
    if (T_sensor_anchor.Translation().norm() > 2.0 * sensor.MaxRange()) continue;
    const Eigen::Matrix3f rotation = T_sensor_anchor.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_sensor_anchor.Translation().cast<float>();
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Eigen::Vector3f p = rotation * MeanOf(table, i) + translation;
      const std::optional<Pixel> pixel = sensor.Project(p);
      if (!pixel) continue;
      if (Sees(keyframe.measurement.range_m, *pixel, p.norm())) {
        const bool lies_on_it =
            !is_old(i) || LiesOnSurface(keyframe.measurement, sensor, *pixel, p, kSameSurfaceM);
        if (!lies_on_it) continue;
        there.push_back(i);
        old_there += range.anchor < oldest_known ? 1 : 0;
      } else if (SeesThrough(keyframe.measurement.range_m, *pixel, p.norm())) {
        through.push_back(i);
      }
    }
  }
  const auto old_through = static_cast<double>(std::ranges::count_if(through, is_old));
  const auto of_old = static_cast<double>(old_there) + old_through;
  const bool map_lies_as_it_did = static_cast<double>(old_there) >= kLiesAsItDid * of_old;
  for (const std::size_t i : through) {
    if (map_lies_as_it_did || !is_old(i)) ++signals_[i].seen_through;
  }
  for (const std::size_t i : there) {
    signals_[i].last_seen = keyframe_number;
    signals_[i].seen_through = 0;
  }
  return through;
}

std::size_t GaussianMap::PruneOpacity(double min_opacity) {
  const auto min_logit = static_cast<float>(std::log(min_opacity / (1.0 - min_opacity)));
  const GaussianColumns<float>& table = engine_->Gaussians();
  std::vector<std::size_t> gone;
  for (const AnchorRange& range : engine_->Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      bool finite = true;
      for (int p = 0; p < kParameterCount; ++p) finite &= std::isfinite(table.Column(p)[i]);
      if (!finite || table.Column(kOpacityLogit)[i] < min_logit) gone.push_back(i);
    }
  }
  return Remove(gone);
}

std::size_t GaussianMap::PruneSeenThrough(std::span<const std::size_t> rows, int keyframes) {
  std::vector<std::size_t> gone;
  for (const std::size_t i : rows) {
    if (signals_[i].seen_through >= keyframes) gone.push_back(i);
  }
  return Remove(gone);
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
                         signals_[i].density};
      if (!disc.u.allFinite() || !disc.v.allFinite()) continue;
      near.discs.push_back(disc);
      near.row.push_back(i);
      near.keyframe.push_back(range.anchor);
    }
  }
  return near;
}

std::size_t GaussianMap::Remove(std::span<const std::size_t> rows) {
  if (rows.empty()) return 0;
  const std::size_t before = Size();
  std::vector<std::uint8_t> keep(engine_->Gaussians().Size(), 1);
  for (const std::size_t i : rows) keep[i] = 0;
  const RowMoves moves = engine_->Keep(keep);
  MoveRows(moves, signals_);
  as_spawned_.Move(moves);
  return before - Size();
}

std::size_t GaussianMap::Bytes() const {
  constexpr std::size_t kColumns = 2 * kParameterCount + kMomentCount;
  return signals_.size() * (kColumns * sizeof(float) + sizeof(GaussianSignals));
}

std::size_t GaussianMap::Size() const {
  std::size_t size = 0;
  for (const AnchorRange& range : engine_->Ranges()) size += range.end - range.begin;
  return size;
}

}  // namespace covsplat
