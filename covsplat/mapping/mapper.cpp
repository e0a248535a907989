#include "covsplat/mapping/mapper.hpp"

#include <algorithm>
#include <utility>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kNearViews = 8;

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
  AddView(number);
  map_.MarkSeen(number, keyframe, sensor_, config_.feedback.max_keyframe_age);
  map_.PruneSeenThrough(config_.manage.prune_seen_through);
}

std::vector<int> Mapper::Views() const {
  std::vector<int> keyframes;
  for (const View& view : views_) keyframes.push_back(view.keyframe);
  return keyframes;
}

double Mapper::Distance(const View& a, const View& b) const {
  return (map_.KeyframePose(a.keyframe).Translation() - map_.KeyframePose(b.keyframe).Translation())
      .norm();
}

void Mapper::AddView(int keyframe) {
  View view{keyframe, 0.0};
  if (!views_.empty()) {
    view.travelled_m = views_.back().travelled_m + Distance(views_.back(), view);
    ThinViews();
  }
  views_.push_back(view);
}

/// The newest view is to become an older one. Of those from about the same place the first of a
/// pass stays, and of several passes the last.
void Mapper::ThinViews() {
  constexpr double kSamePass = 3.0;  // in spacings of the way
  const double spacing_m = config_.schedule.view_spacing_m;
  const View newest = views_.back();
  views_.pop_back();
  const auto is_near = [&](const View& view) { return Distance(view, newest) < spacing_m; };
  const bool is_known = std::ranges::any_of(views_, [&](const View& view) {
    return is_near(view) && newest.travelled_m - view.travelled_m < kSamePass * spacing_m;
  });
  if (is_known) {
    map_.Engine().DropView(newest.keyframe);
    return;
  }
  std::erase_if(views_, [&](const View& view) {
    if (!is_near(view)) return false;
    map_.Engine().DropView(view.keyframe);
    return true;
  });
  views_.push_back(newest);
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
  for (const View& view : views_) {
    const SE3& pose = map_.KeyframePose(view.keyframe);
    const bool is_done = std::ranges::any_of(done, [&](const Eigen::Vector3d& position) {
      return (position - pose.Translation()).norm() < 0.5 * reach_m;
    });
    if (is_done) continue;
    done.push_back(pose.Translation());
    JoinSurfaces(map_, pose, reach_m, config_.spawn.patches.extent_factor, config_.manage);
  }
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
  if (views_.empty()) return;
  const ScheduleConfig& schedule = config_.schedule;
  Visit(views_.back().keyframe, schedule.steps_new);
  Visit(RandomNearView(), schedule.steps_near);
  Visit(RandomView(), schedule.steps_old);
}

void Mapper::OptimizeHurriedly() {
  if (!views_.empty()) Visit(views_.back().keyframe, config_.schedule.steps_hurried);
}

void Mapper::OptimizeIdle() {
  if (views_.empty()) return;
  const bool near = rng_.Uniform() < 0.5;
  Visit(near ? RandomNearView() : RandomView(), config_.schedule.steps_per_visit);
}

void Mapper::Conclude() {
  if (views_.empty()) return;
  if (map_.Keyframes() % config_.manage.interval != 0) Manage();
  if (T_map_odom_) JoinPasses();
  for (int left = config_.schedule.final_steps; left > 0;
       left -= config_.schedule.steps_per_visit) {
    Visit(RandomView(), std::min(left, config_.schedule.steps_per_visit));
  }
}

int Mapper::RandomView() { return views_[rng_.Below(views_.size())].keyframe; }

int Mapper::RandomNearView() {
  std::vector<std::pair<double, int>> by_distance;
  by_distance.reserve(views_.size());
  for (const View& view : views_) {
    by_distance.emplace_back(Distance(view, views_.back()), view.keyframe);
  }
  const std::size_t near = std::min(by_distance.size(), kNearViews);
  std::partial_sort(by_distance.begin(),
                    by_distance.begin() + static_cast<std::ptrdiff_t>(near),
                    by_distance.end());
  return by_distance[rng_.Below(near)].second;
}

std::shared_ptr<const RegistrationTarget> Mapper::MakeTarget(const SE3& T_odom_sensor) {
  const ScopedTimer timer(times_, "target");
  return BuildTarget(map_, T_map_odom_, T_odom_sensor, 1.2 * sensor_.MaxRange(), config_.feedback);
}

}  // namespace covsplat
