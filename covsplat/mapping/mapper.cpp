#include "covsplat/mapping/mapper.hpp"

#include <algorithm>
#include <utility>

namespace covsplat {
namespace {

constexpr std::size_t kNearKeyframes = 8;

/// `gone`: ascending indices.
std::vector<Disc> Without(std::span<const std::size_t> gone, std::span<const Disc> discs) {
  std::vector<Disc> left;
  left.reserve(discs.size() - gone.size());
  auto next = gone.begin();
  for (std::size_t i = 0; i < discs.size(); ++i) {
    if (next != gone.end() && *next == i) {
      ++next;
    } else {
      left.push_back(discs[i]);
    }
  }
  return left;
}

}  // namespace

Mapper::Mapper(std::unique_ptr<SplatEngine> engine,
               const SensorModel& sensor,
               const MapperConfig& config,
               ThreadPool& pool)
    : sensor_(sensor),
      config_(config),
      pool_(pool),
      map_(std::move(engine)),
      free_space_(sensor, config.reliability) {}

void Mapper::Insert(Keyframe keyframe) {
  MaskMoved(keyframe);
  Spawn(keyframe);
  if (map_.Keyframes() % config_.manage.interval == 0) Manage(keyframe.tracked.T_map_sensor);
}

void Mapper::MaskMoved(Keyframe& keyframe) {
  const ScopedTimer timer(times_, "reliability");
  const std::vector<std::uint8_t> moved =
      free_space_.FindMoved(keyframe.tracked.surface, keyframe.tracked.T_map_sensor, pool_);
  free_space_.Remember(keyframe);
  MaskSurfaces(moved, keyframe);
}

/// Patches through all scans since the last keyframe, less those of what has moved meanwhile.
PatchFit Mapper::FindPatches(const Keyframe& keyframe, const NearGaussians& near) const {
  PatchFit fit = FitPatches(keyframe, near.discs, sensor_, config_.spawn, pool_);
  std::vector<Eigen::Vector3f> middles;
  for (const Patch& patch : fit.patches) middles.push_back(patch.mean);
  const std::vector<std::uint8_t> moved =
      free_space_.FindMoved(middles, keyframe.tracked.T_map_sensor, pool_);
  std::size_t i = 0;
  std::erase_if(fit.patches, [&](const Patch&) { return moved[i++] != 0; });
  return fit;
}

void Mapper::Spawn(const Keyframe& keyframe) {
  const ScopedTimer timer(times_, "insert");
  const SE3& T_map_sensor = keyframe.tracked.T_map_sensor;
  const NearGaussians near = map_.Near(T_map_sensor, sensor_.MaxRange());
  const PatchFit fit = FindPatches(keyframe, near);
  std::vector<std::size_t> replaced;
  for (const std::size_t i : fit.replaced) replaced.push_back(near.row[i]);
  map_.Remove(replaced);
  std::optional<RenderOutput> render;
  if (map_.Keyframes() > 0) render = Render(T_map_sensor);
  const std::vector<Disc> staying = Without(fit.replaced, near.discs);
  const SpawnedGaussians spawned =
      SpawnGaussians(keyframe, fit, render ? &*render : nullptr, staying, sensor_, config_.spawn);
  const int number = map_.AddKeyframe(keyframe, spawned);
  map_.MarkSeen(number, keyframe, sensor_);
  map_.PruneSeenThrough(config_.manage.prune_seen_through);
}

void Mapper::Manage(const SE3& T_map_sensor) {
  const ScopedTimer timer(times_, "manage");
  ManageMap(
      map_, T_map_sensor, sensor_.MaxRange(), config_.spawn.patches.extent_factor, config_.manage);
}

void Mapper::Visit(int keyframe, int steps) {
  if (!config_.IsRefined()) return;
  const ScopedTimer timer(times_, "optimize");
  for (int i = 0; i < steps; ++i) {
    const bool surface_normals = steps_ >= config_.engine.loss.surface_normal_start;
    map_.Engine().Step(keyframe, surface_normals);
    ++steps_;
  }
}

void Mapper::OptimizeNewest() {
  if (map_.Keyframes() == 0) return;
  const ScheduleConfig& schedule = config_.schedule;
  Visit(map_.Keyframes() - 1, schedule.steps_new);
  Visit(RandomNearKeyframe(), schedule.steps_near);
  Visit(static_cast<int>(rng_.Below(static_cast<std::uint64_t>(map_.Keyframes()))),
        schedule.steps_old);
}

void Mapper::OptimizeHurriedly() {
  if (map_.Keyframes() > 0) Visit(map_.Keyframes() - 1, config_.schedule.steps_hurried);
}

void Mapper::OptimizeIdle() {
  if (map_.Keyframes() == 0) return;
  const auto all = static_cast<std::uint64_t>(map_.Keyframes());
  const bool near = rng_.Uniform() < 0.5;
  Visit(near ? RandomNearKeyframe() : static_cast<int>(rng_.Below(all)),
        config_.schedule.steps_per_visit);
}

void Mapper::OptimizeFinally() {
  if (map_.Keyframes() == 0) return;
  const auto all = static_cast<std::uint64_t>(map_.Keyframes());
  for (int left = config_.schedule.final_steps; left > 0;
       left -= config_.schedule.steps_per_visit) {
    Visit(static_cast<int>(rng_.Below(all)), std::min(left, config_.schedule.steps_per_visit));
  }
}

int Mapper::RandomNearKeyframe() {
  const Eigen::Vector3d here = map_.KeyframePose(map_.Keyframes() - 1).Translation();
  std::vector<std::pair<double, int>> by_distance;
  by_distance.reserve(static_cast<std::size_t>(map_.Keyframes()));
  for (int k = 0; k < map_.Keyframes(); ++k) {
    by_distance.emplace_back((map_.KeyframePose(k).Translation() - here).norm(), k);
  }
  const std::size_t near = std::min(by_distance.size(), kNearKeyframes);
  std::partial_sort(by_distance.begin(),
                    by_distance.begin() + static_cast<std::ptrdiff_t>(near),
                    by_distance.end());
  return by_distance[rng_.Below(near)].second;
}

std::shared_ptr<const RegistrationTarget> Mapper::MakeTarget(const SE3& T_map_sensor) {
  const ScopedTimer timer(times_, "target");
  return BuildTarget(map_, T_map_sensor, 1.2 * sensor_.MaxRange(), config_.feedback);
}

}  // namespace covsplat
