#include "covsplat/mapping/gaussian_map.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
namespace {

/// Ranges in pieces for threads to share.
std::vector<AnchorRange> PiecesOf(std::span<const AnchorRange> ranges) {
  constexpr std::size_t kPiece = 2048;
  std::vector<AnchorRange> pieces;
  for (const AnchorRange& range : ranges) {
    for (std::size_t begin = range.begin; begin < range.end; begin += kPiece) {
      pieces.push_back({range.anchor, begin, std::min(begin + kPiece, range.end)});
    }
  }
  return pieces;
}

/// f(piece) of each.
template <class F>
auto OfEach(ThreadPool& pool, std::span<const AnchorRange> pieces, F&& f) {
  std::vector<decltype(f(pieces.front()))> results(pieces.size());
  ParallelFor(
      pool, pieces.size(), 1, [&](std::size_t k, std::size_t) { results[k] = f(pieces[k]); });
  return results;
}

/// The rows of keyframes within a distance of a position, in pieces.
std::vector<AnchorRange> PiecesNear(const SplatEngine& engine,
                                    const Eigen::Vector3d& position_map,
                                    double distance_m) {
  std::vector<AnchorRange> near;
  for (const AnchorRange& range : engine.Ranges()) {
    const SE3& T_map_anchor = engine.AnchorPoses()[static_cast<std::size_t>(range.anchor)];
    const double apart_m = (T_map_anchor.Translation() - position_map).norm();
    if (apart_m <= distance_m) near.push_back(range);
  }
  return PiecesOf(near);
}

/// Rows whose opacity is below a limit, or with anything that is not finite.
std::vector<std::size_t> RowsBelow(const GaussianColumns<float>& table,
                                   const AnchorRange& piece,
                                   float min_logit) {
  const std::size_t size = piece.end - piece.begin;
  std::vector<std::uint8_t> stays(size);
  const float* const logit = table.Column(kOpacityLogit) + piece.begin;
  for (std::size_t i = 0; i < size; ++i) stays[i] = logit[i] >= min_logit;
  for (int p = 0; p < kParameterCount; ++p) {
    const float* const column = table.Column(p) + piece.begin;
    for (std::size_t i = 0; i < size; ++i) stays[i] &= std::isfinite(column[i]);
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < size; ++i) {
    if (stays[i] == 0) rows.push_back(piece.begin + i);
  }
  return rows;
}

/// What a keyframe shows of a part of the map.
struct Sighting {
  std::vector<std::size_t> there;    ///< rows that are where something is measured
  std::vector<std::size_t> through;  ///< rows in front of what is measured
  std::size_t old_there = 0;         ///< of the former, those of old keyframes

  void Append(const Sighting& other) {
    there.insert(there.end(), other.there.begin(), other.there.end());
    through.insert(through.end(), other.through.begin(), other.through.end());
    old_there += other.old_there;
  }
};

Sighting LookAt(const GaussianColumns<float>& table,
                std::span<const GaussianSignals> signals,
                const AnchorRange& piece,
                const SE3& T_sensor_anchor,
                const RangeMeasurement& measurement,
                const SensorModel& sensor,
                int oldest_known) {
  constexpr float kSameSurfaceM = 0.1f;
  // What is farther than any measurement is neither seen nor seen through.
  const auto farthest_m = static_cast<float>(1.1 * sensor.MaxRange());
  const Eigen::Matrix3f rotation = T_sensor_anchor.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_sensor_anchor.Translation().cast<float>();
  Sighting sighting;
  for (std::size_t i = piece.begin; i < piece.end; ++i) {
    const Eigen::Vector3f p = rotation * MeanOf(table, i) + translation;
    const float range_m = p.norm();
    const auto pixel = range_m < farthest_m ? sensor.Project(p) : std::nullopt;
    if (!pixel) continue;
    if (Sees(measurement.range_m, *pixel, range_m)) {
      const bool lies_on_it = signals[i].last_seen >= oldest_known ||
                              LiesOnSurface(measurement, sensor, *pixel, p, kSameSurfaceM);
      if (!lies_on_it) continue;
      sighting.there.push_back(i);
      sighting.old_there += piece.anchor < oldest_known ? 1 : 0;
    } else if (SeesThrough(measurement.range_m, *pixel, range_m)) {
      sighting.through.push_back(i);
    }
  }
  return sighting;
}

NearGaussians WithinRange(const GaussianColumns<float>& table,
                          std::span<const GaussianSignals> signals,
                          const AnchorRange& piece,
                          const SE3& T_sensor_anchor,
                          double distance_m) {
  const auto limit = static_cast<float>(distance_m * distance_m);
  const Eigen::Matrix3f rotation = T_sensor_anchor.RotationMatrix().cast<float>();
  const Eigen::Vector3f translation = T_sensor_anchor.Translation().cast<float>();
  NearGaussians near;
  for (std::size_t i = piece.begin; i < piece.end; ++i) {
    const Eigen::Vector3f mean = rotation * MeanOf(table, i) + translation;
    if (!(mean.squaredNorm() < limit)) continue;
    const Eigen::Matrix3f axes = rotation * RotationOf(table, i).normalized().toRotationMatrix();
    const Disc disc = {mean,
                       std::exp(table.Column(kLogScaleU)[i]) * axes.col(0),
                       std::exp(table.Column(kLogScaleV)[i]) * axes.col(1),
                       signals[i].density};
    if (!disc.u.allFinite() || !disc.v.allFinite()) continue;
    near.discs.push_back(disc);
    near.row.push_back(i);
    near.keyframe.push_back(piece.anchor);
  }
  return near;
}

NearGaussians Joined(std::span<const NearGaussians> parts) {
  std::size_t size = 0;
  for (const NearGaussians& part : parts) size += part.discs.size();
  NearGaussians all;
  all.discs.reserve(size);
  all.row.reserve(size);
  all.keyframe.reserve(size);
  for (const NearGaussians& part : parts) {
    all.discs.insert(all.discs.end(), part.discs.begin(), part.discs.end());
    all.row.insert(all.row.end(), part.row.begin(), part.row.end());
    all.keyframe.insert(all.keyframe.end(), part.keyframe.begin(), part.keyframe.end());
  }
  return all;
}

}  // namespace

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
  const int oldest_known = keyframe_number - max_age;
  const SE3 T_map_sensor = keyframe.PoseInMap();
  const GaussianColumns<float>& table = engine_->Gaussians();
  const auto pieces = PiecesNear(*engine_, T_map_sensor.Translation(), 2.0 * sensor.MaxRange());
  const auto parts = OfEach(*pool_, pieces, [&](const AnchorRange& piece) {
    const SE3 T_sensor_anchor = T_map_sensor.Inverse() * KeyframePose(piece.anchor);
    return LookAt(
        table, signals_, piece, T_sensor_anchor, keyframe.measurement, sensor, oldest_known);
  });
  Sighting all;
  for (const Sighting& part : parts) all.Append(part);

  const auto is_old = [&](std::size_t i) { return signals_[i].last_seen < oldest_known; };
  const auto old_through = static_cast<double>(std::ranges::count_if(all.through, is_old));
  const auto old_there = static_cast<double>(all.old_there);
  const bool map_lies_as_it_did = old_there >= kLiesAsItDid * (old_there + old_through);
  for (const std::size_t i : all.through) {
    if (map_lies_as_it_did || !is_old(i)) ++signals_[i].seen_through;
  }
  for (const std::size_t i : all.there) {
    signals_[i].last_seen = keyframe_number;
    signals_[i].seen_through = 0;
  }
  return all.through;
}

std::size_t GaussianMap::PruneOpacity(double min_opacity) {
  const auto min_logit = static_cast<float>(std::log(min_opacity / (1.0 - min_opacity)));
  const GaussianColumns<float>& table = engine_->Gaussians();
  const auto parts = OfEach(*pool_, PiecesOf(engine_->Ranges()), [&](const AnchorRange& piece) {
    return RowsBelow(table, piece, min_logit);
  });
  std::vector<std::size_t> gone;
  for (const std::vector<std::size_t>& part : parts) {
    gone.insert(gone.end(), part.begin(), part.end());
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
  const GaussianColumns<float>& table = engine_->Gaussians();
  const auto pieces = PiecesNear(*engine_, T_map_sensor.Translation(), 2.0 * distance_m);
  return Joined(OfEach(*pool_, pieces, [&](const AnchorRange& piece) {
    const SE3 T_sensor_anchor = T_map_sensor.Inverse() * KeyframePose(piece.anchor);
    return WithinRange(table, signals_, piece, T_sensor_anchor, distance_m);
  }));
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
