#include "covsplat/mapping/mapper.hpp"

#include <algorithm>
#include <utility>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

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
      map_(std::move(engine), pool),
      free_space_(sensor, config.reliability),
      views_(map_, static_cast<std::size_t>(sensor.Rows() * sensor.Columns()), config.schedule) {}

void Mapper::Insert(Keyframe keyframe) {
  keyframe.T_map_odom = T_map_odom_;
  T_odom_newest_ = keyframe.tracked.T_odom_sensor;
  MaskMoved(keyframe);
  Spawn(keyframe);
  if (map_.Keyframes() % config_.manage.interval == 0) Manage();
}

void Mapper::Correct(std::span<const SE3> T_map_keyframe) {
  const auto corrected = static_cast<int>(T_map_keyframe.size());
  COVSPLAT_CHECK(corrected > 0 && corrected <= map_.Keyframes());
  const SE3 moved = T_map_keyframe.back() * map_.KeyframePose(corrected - 1).Inverse();
  for (int k = 0; k < map_.Keyframes(); ++k) {
    const SE3 pose =
        k < corrected ? T_map_keyframe[static_cast<std::size_t>(k)] : moved * map_.KeyframePose(k);
    map_.Engine().SetAnchorPose(k, pose);
  }
  T_map_odom_ = map_.KeyframePose(map_.Keyframes() - 1) * T_odom_newest_.Inverse();
}

void Mapper::MaskMoved(Keyframe& keyframe) {
  const ScopedTimer timer(times_, "reliability");
  const std::vector<std::uint8_t> moved =
      free_space_.FindMoved(keyframe.tracked.surface, keyframe.tracked.T_odom_sensor, pool_);
  free_space_.Remember(keyframe);
  MaskSurfaces(moved, keyframe);
}

/// Patches through all scans since the last keyframe, less those of what has moved meanwhile.
PatchFit Mapper::FindPatches(const Keyframe& keyframe, const NearGaussians& near) const {
  PatchFit fit = FitPatches(keyframe, near.discs, sensor_, config_.spawn, pool_);
  std::vector<Eigen::Vector3f> middles;
  for (const Patch& patch : fit.patches) middles.push_back(patch.mean);
  const std::vector<std::uint8_t> moved =
      free_space_.FindMoved(middles, keyframe.tracked.T_odom_sensor, pool_);
  std::size_t i = 0;
  std::erase_if(fit.patches, [&](const Patch&) { return moved[i++] != 0; });
  return fit;
}

void Mapper::Spawn(const Keyframe& keyframe) {
  const ScopedTimer timer(times_, "insert");
  const SE3 T_map_sensor = keyframe.PoseInMap();
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
  views_.Add(number);
  const std::vector<std::size_t> through =
      map_.MarkSeen(number, keyframe, sensor_, config_.feedback.max_keyframe_age);
  map_.PruneSeenThrough(through, config_.manage.prune_seen_through);
}

void Mapper::Manage() {
  const ScopedTimer timer(times_, "manage");
  ManageMap(map_,
            map_.KeyframePose(map_.Keyframes() - 1),
            sensor_.MaxRange(),
            map_.Keyframes() - config_.manage.interval,
            config_.spawn.patches.extent_factor,
            config_.manage);
}

/// What loops have brought together, all along the way.
void Mapper::JoinPasses() {
  const ScopedTimer timer(times_, "manage");
  const double reach_m = sensor_.MaxRange();
  std::vector<Eigen::Vector3d> done;
  for (const int keyframe : views_.Keyframes()) {
    const SE3& pose = map_.KeyframePose(keyframe);
    const bool is_done = std::ranges::any_of(done, [&](const Eigen::Vector3d& position) {
      return (position - pose.Translation()).norm() < 0.5 * reach_m;
    });
    if (is_done) continue;
    done.push_back(pose.Translation());
    JoinSurfaces(map_, pose, reach_m, config_.spawn.patches.extent_factor, config_.manage);
  }
}

void Mapper::Visit(int keyframe, int steps, const std::function<bool()>& stop) {
  if (!config_.IsRefined() || steps == 0) return;
  const ScopedTimer timer(times_, "optimize");
  StepReport report;
  int taken = 0;
  while (taken < steps && !(taken > 0 && stop())) {
    const bool surface_normals = steps_ >= config_.engine.loss.surface_normal_start;
    report = map_.Engine().Step(keyframe, surface_normals);
    ++steps_;
    ++taken;
  }
  views_.Trained(keyframe, taken, report.Loss());
}

void Mapper::OptimizeNewest() {
  if (views_.Empty()) return;
  const ScheduleConfig& schedule = config_.schedule;
  Visit(views_.Newest(), schedule.steps_new);
  Visit(views_.RandomNear(), schedule.steps_near);
  Visit(views_.Random(), schedule.steps_old);
}

void Mapper::OptimizeHurriedly() {
  if (!views_.Empty()) Visit(views_.Newest(), config_.schedule.steps_hurried);
}

bool Mapper::OptimizeIdle(const std::function<bool()>& stop) {
  const std::optional<int> keyframe = views_.Neediest();
  if (keyframe) Visit(*keyframe, config_.schedule.steps_per_visit, stop);
  return keyframe.has_value();
}

void Mapper::Conclude() {
  if (views_.Empty()) return;
  if (map_.Keyframes() % config_.manage.interval != 0) Manage();
  if (T_map_odom_) JoinPasses();
  for (int left = config_.schedule.final_steps; left > 0;
       left -= config_.schedule.steps_per_visit) {
    Visit(views_.Random(), std::min(left, config_.schedule.steps_per_visit));
  }
  views_.ForgetAll();
}

std::shared_ptr<const RegistrationTarget> Mapper::MakeTarget(const SE3& T_odom_sensor) {
  const ScopedTimer timer(times_, "target");
  return BuildTarget(map_, T_map_odom_, T_odom_sensor, 1.2 * sensor_.MaxRange(), config_.feedback);
}

}  // namespace covsplat
