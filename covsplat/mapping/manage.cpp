#include "covsplat/mapping/manage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "covsplat/core/percentile.hpp"
#include "covsplat/registration/voxel_hash.hpp"

namespace covsplat {
namespace {

float OpacityAt(const GaussianMap& map, std::size_t row) {
  return OpacityOf(map.Engine().Gaussians(), row);
}

float AreaOf(const Disc& disc) { return disc.u.norm() * disc.v.norm(); }

/// Gaussians that go, by row, and those that come in their place.
class Exchange {
 public:
  /// `T_map_frame`: of the discs that come.
  Exchange(GaussianMap& map, const SE3& T_map_frame) : map_(map), T_map_frame_(T_map_frame) {}

  void Remove(std::size_t row) { gone_.push_back(row); }

  /// A disc that is kept in the frame of a keyframe.
  void Add(int keyframe, const Disc& disc, float opacity, const GaussianSignals& signals) {
    constexpr float kMaxOpacity = 0.999f;
    Fresh& fresh = fresh_[keyframe];
    if (fresh.spawned.signals.empty()) {
      fresh.T_keyframe_frame = map_.KeyframePose(keyframe).Inverse() * T_map_frame_;
    }
    const Eigen::Matrix3f rotation = fresh.T_keyframe_frame.RotationMatrix().cast<float>();
    Eigen::Matrix3f axes;
    axes << disc.u.normalized(), disc.v.normalized(), disc.u.cross(disc.v).normalized();
    const float alpha = std::min(opacity, kMaxOpacity);
    fresh.spawned.Add(rotation * disc.mean + fresh.T_keyframe_frame.Translation().cast<float>(),
                      rotation * axes,
                      {std::log(disc.u.norm()), std::log(disc.v.norm())},
                      std::log(alpha / (1.0f - alpha)),
                      signals);
  }

  void Apply() {
    if (gone_.empty()) return;
    for (const auto& [keyframe, fresh] : fresh_) map_.Append(keyframe, fresh.spawned);
    map_.Remove(gone_);
  }

 private:
  struct Fresh {
    SE3 T_keyframe_frame;
    SpawnedGaussians spawned;
  };

  GaussianMap& map_;
  const SE3 T_map_frame_;
  std::vector<std::size_t> gone_;
  std::map<int, Fresh> fresh_;  ///< by keyframe
};

/// Control score that a share of the Gaussians does not exceed; of none known, none.
float ControlQuantile(const GaussianMap& map, const NearGaussians& near, double share) {
  std::vector<float> scores;
  for (const std::size_t row : near.row) {
    const float score = map.Signals()[row].control_score;
    if (!std::isnan(score)) scores.push_back(score);
  }
  if (scores.empty()) return std::numeric_limits<float>::quiet_NaN();
  return Percentile(scores, share);
}

/// [near] whether a Gaussian is in a cell with, or next to, one of the last keyframes.
std::vector<std::uint8_t> WhichAreNextToNew(const NearGaussians& near,
                                            int first_new_keyframe,
                                            double cell_m) {
  constexpr int kNeighbours = 27;
  const auto cell_of = [&](const Disc& disc) {
    return CellOf(Eigen::Vector3f(disc.mean / static_cast<float>(cell_m)));
  };
  VoxelHash cells;
  for (std::size_t i = 0; i < near.discs.size(); ++i) {
    if (near.keyframe[i] < first_new_keyframe) continue;
    const Eigen::Vector3i cell = cell_of(near.discs[i]);
    for (int k = 0; k < kNeighbours; ++k) {
      cells.FindOrInsert(cell + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1), 0);
    }
  }
  std::vector<std::uint8_t> is_next;
  is_next.reserve(near.discs.size());
  for (const Disc& disc : near.discs) is_next.push_back(cells.Find(cell_of(disc)) >= 0);
  return is_next;
}

/// What is known of several Gaussians together.
GaussianSignals Joined(const GaussianMap& map,
                       const NearGaussians& near,
                       std::span<const std::size_t> members,
                       float area_m2) {
  GaussianSignals joined;
  joined.seen_through = std::numeric_limits<int>::max();
  float all = 0.0f;
  float known = 0.0f;
  float scores = 0.0f;
  for (const std::size_t i : members) {
    const GaussianSignals& one = map.Signals()[near.row[i]];
    const float area = AreaOf(near.discs[i]);
    all += area;
    joined.confidence += area * one.confidence;
    joined.intensity += area * one.intensity;
    joined.density += area * one.density / area_m2;
    joined.last_seen = std::max(joined.last_seen, one.last_seen);
    joined.seen_through = std::min(joined.seen_through, one.seen_through);
    joined.splits = std::max(joined.splits, one.splits);
    joined.trackable |= one.trackable;
    if (std::isnan(one.control_score)) continue;
    known += area;
    scores += area * one.control_score;
  }
  joined.confidence /= all;
  joined.intensity /= all;
  if (known > 0.0f) joined.control_score = scores / known;
  return joined;
}

void CoverAndPrune(GaussianMap& map,
                   const SE3& T_map_sensor,
                   double reach_m,
                   int first_keyframe,
                   double extent_factor,
                   const ManageConfig& config) {
  const NearGaussians near = map.Near(T_map_sensor, reach_m);
  const float limit = ControlQuantile(map, near, config.plane.control_quantile);
  const std::vector<std::uint8_t> is_next =
      WhichAreNextToNew(near, first_keyframe, config.plane.cell_m);
  std::vector<std::size_t> chosen;
  std::vector<PlanarGaussian> planar;
  for (std::size_t i = 0; i < near.discs.size(); ++i) {
    const float opacity = OpacityAt(map, near.row[i]);
    const bool is_planar =
        !config.feature_aware || map.Signals()[near.row[i]].control_score <= limit;
    if (is_next[i] == 0 || !is_planar || opacity < config.plane.min_opacity) continue;
    chosen.push_back(i);
    planar.push_back({near.discs[i], opacity});
  }
  Exchange exchange(map, T_map_sensor);
  for (const PlaneCover& cover : CoverPlanes(planar, extent_factor, config.plane)) {
    std::vector<std::size_t> members;
    int keyframe = 0;  // the newest among those of its members
    for (const std::size_t i : cover.members) {
      members.push_back(chosen[i]);
      keyframe = std::max(keyframe, near.keyframe[chosen[i]]);
      exchange.Remove(near.row[chosen[i]]);
    }
    exchange.Add(
        keyframe, cover.disc, cover.opacity, Joined(map, near, members, AreaOf(cover.disc)));
  }
  exchange.Apply();
}

bool Covers(const ManageConfig& config) {
  return config.mode == ManageMode::kPlane || config.mode == ManageMode::kFull;
}

/// The Gaussians to split, the most urgent first.
std::vector<std::size_t> ChooseToSplit(const GaussianMap& map,
                                       const NearGaussians& near,
                                       const ManageConfig& config) {
  const float limit = ControlQuantile(map, near, config.split.control_quantile);
  std::vector<std::pair<float, std::size_t>> wanted;
  for (std::size_t i = 0; i < near.discs.size(); ++i) {
    const float major_m = std::max(near.discs[i].u.norm(), near.discs[i].v.norm());
    const GaussianSignals& signals = map.Signals()[near.row[i]];
    if (major_m < config.split.min_scale_m || signals.splits >= config.split.max_splits) continue;
    if (OpacityAt(map, near.row[i]) < config.split.min_opacity) continue;
    if (config.feature_aware && !(signals.control_score >= limit)) continue;
    wanted.emplace_back(config.feature_aware ? -signals.control_score : -major_m, i);
  }
  const auto most = std::max<std::size_t>(
      1, static_cast<std::size_t>(config.split.max_share * static_cast<double>(near.discs.size())));
  const std::size_t count = std::min(most, wanted.size());
  std::ranges::partial_sort(wanted, wanted.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(wanted[k].second);
  return chosen;
}

/// Each becomes its two halves along the longer axis: what a Gaussian stands for, cut in the
/// middle.
void Split(GaussianMap& map,
           const SE3& T_map_sensor,
           double reach_m,
           double extent_factor,
           const ManageConfig& config) {
  const auto offset = static_cast<float>(0.5 * std::numbers::sqrt3 / extent_factor);
  const NearGaussians near = map.Near(T_map_sensor, reach_m);
  Exchange exchange(map, T_map_sensor);
  for (const std::size_t i : ChooseToSplit(map, near, config)) {
    const Disc& whole = near.discs[i];
    GaussianSignals signals = map.Signals()[near.row[i]];
    ++signals.splits;
    const bool along_u = whole.u.squaredNorm() >= whole.v.squaredNorm();
    for (const float side : {-1.0f, 1.0f}) {
      Disc half = whole;
      half.mean += side * offset * (along_u ? whole.u : whole.v);
      (along_u ? half.u : half.v) *= 0.5f;
      exchange.Add(near.keyframe[i], half, OpacityAt(map, near.row[i]), signals);
    }
    exchange.Remove(near.row[i]);
  }
  exchange.Apply();
}

/// How many Gaussians there may be.
std::size_t LimitOf(const ManageConfig& config) {
  auto limit = std::numeric_limits<std::size_t>::max();
  if (config.max_gaussians > 0) limit = static_cast<std::size_t>(config.max_gaussians);
  if (config.budget_mb > 0.0) {
    const double gaussians = 1e6 * config.budget_mb / static_cast<double>(kBytesPerGaussian);
    limit = std::min(limit, static_cast<std::size_t>(gaussians));
  }
  return limit;
}

/// Removes the Gaussians that show least, opacity times area, beyond a number.
void Shed(GaussianMap& map, std::size_t max_gaussians) {
  if (map.Size() <= max_gaussians) return;
  const GaussianColumns<float>& table = map.Engine().Gaussians();
  std::vector<std::pair<float, std::size_t>> by_value;
  for (const AnchorRange& range : map.Engine().Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const float log_area = table.Column(kLogScaleU)[i] + table.Column(kLogScaleV)[i];
      by_value.emplace_back(OpacityAt(map, i) * std::exp(log_area), i);
    }
  }
  const std::size_t excess = by_value.size() - max_gaussians;
  std::ranges::nth_element(by_value, by_value.begin() + static_cast<std::ptrdiff_t>(excess));
  std::vector<std::size_t> gone;
  for (std::size_t k = 0; k < excess; ++k) gone.push_back(by_value[k].second);
  map.Remove(gone);
}

}  // namespace

void ManageMap(GaussianMap& map,
               const SE3& T_map_sensor,
               double reach_m,
               int first_keyframe,
               double extent_factor,
               const ManageConfig& config) {
  map.PruneOpacity(config.prune_opacity);
  const bool splits = config.mode == ManageMode::kSplit || config.mode == ManageMode::kFull;
  if (Covers(config)) {
    CoverAndPrune(map, T_map_sensor, reach_m, first_keyframe, extent_factor, config);
  }
  if (splits) Split(map, T_map_sensor, reach_m, extent_factor, config);
  Shed(map, LimitOf(config));
}

void JoinSurfaces(GaussianMap& map,
                  const SE3& T_map_sensor,
                  double reach_m,
                  double extent_factor,
                  const ManageConfig& config) {
  if (Covers(config)) CoverAndPrune(map, T_map_sensor, reach_m, 0, extent_factor, config);
}

}  // namespace covsplat
