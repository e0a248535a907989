#include "covsplat/slam/slam_system.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "covsplat/core/background.hpp"
#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

/// The tracker waits for the mapper when this many keyframes are on their way.
constexpr std::size_t kKeyframeQueue = 3;
constexpr std::size_t kMaxHeldOut = 40;
/// Idle visits of the mapper between two targets.
constexpr int kVisitsPerTarget = 3;

void AddTimes(StageTimes& to, const StageTimes& from) {
  for (const auto& [stage, ms] : from.Stages()) to.Add(stage, ms);
}

ScanRecord MakeRecord(const TrackResult& result) {
  ScanRecord record;
  record.scan = result.tracked.scan;
  record.stamp_s = result.tracked.stamp_s;
  record.state = result.state;
  record.is_keyframe = result.is_keyframe;
  record.points = result.points;
  record.not_finite = result.not_finite;
  record.out_of_range = result.out_of_range;
  record.has_time = result.has_time;
  record.source_points = result.tracked.surface.size();
  record.correspondences = result.align.correspondences;
  record.inlier_ratio = result.align.inlier_ratio;
  record.overlap = result.overlap;
  record.support = result.support;
  record.rms_residual_m = result.align.rms_residual_m;
  record.iterations = result.align.iterations;
  record.degenerate_directions = result.align.degenerate_directions;
  record.times = result.times;
  return record;
}

struct Pools {
  std::unique_ptr<ThreadPool> track;
  std::unique_ptr<ThreadPool> map;
};

/// In lockstep each has all threads. Otherwise tracking has half of them, and mapping the rest, or,
/// where there are no more processors than threads, as many as there are: it then takes all that
/// tracking leaves.
Pools MakePools(const SystemConfig& config) {
  const int processors = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int all = config.threads > 0 ? config.threads : processors;
  if (config.schedule == Schedule::kLockstep) {
    return {std::make_unique<ThreadPool>(all), std::make_unique<ThreadPool>(all)};
  }
  const int tracking = (all + 1) / 2;
  const int mapping = all < processors ? std::max(1, all - tracking) : all;
  return {std::make_unique<ThreadPool>(tracking), MakeBackgroundPool(mapping)};
}

/// Gaussians as flat pieces of surface.
std::vector<AnchoredSurfel> SurfelsOf(const GaussianMap& map) {
  const GaussianColumns<float>& table = map.Engine().Gaussians();
  std::vector<AnchoredSurfel> surfels;
  for (const AnchorRange& range : map.Engine().Ranges()) {
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Eigen::Vector3f normal = RotationOf(table, i).normalized() * Eigen::Vector3f::UnitZ();
      if (!MeanOf(table, i).allFinite() || !normal.allFinite()) continue;
      surfels.push_back({range.anchor, MeanOf(table, i), normal});
    }
  }
  return surfels;
}

/// From the first keyframe to each.
std::vector<double> WaysAlong(const std::vector<SE3>& T_map_keyframe) {
  std::vector<double> way_m;
  for (std::size_t k = 0; k < T_map_keyframe.size(); ++k) {
    const SE3& before = T_map_keyframe[k > 0 ? k - 1 : 0];
    const double step_m = (T_map_keyframe[k].Translation() - before.Translation()).norm();
    way_m.push_back((way_m.empty() ? 0.0 : way_m.back()) + step_m);
  }
  return way_m;
}

LoopKeyframe LoopKeyframeOf(int keyframe, const TrackedScan& tracked, double voxel_m) {
  return {tracked.T_odom_sensor,
          tracked.knowledge,
          MakePlace(keyframe, tracked.points, tracked.surface, tracked.covariance, voxel_m)};
}

}  // namespace

Result<std::unique_ptr<SlamSystem>> SlamSystem::Create(const SlamConfig& config,
                                                       const SensorModel& sensor) {
  if (const Result<void> valid = CheckSlamConfig(config); !valid) return Forward(valid);
  auto [track_pool, map_pool] = MakePools(config.system);
  auto engine = MakeSplatEngine(config.system.backend, sensor, config.mapper.engine, *map_pool);
  if (!engine) return Forward(engine);
  return std::unique_ptr<SlamSystem>(new SlamSystem(
      config, sensor, std::move(track_pool), std::move(map_pool), std::move(*engine)));
}

SlamSystem::SlamSystem(const SlamConfig& config,
                       const SensorModel& sensor,
                       std::unique_ptr<ThreadPool> track_pool,
                       std::unique_ptr<ThreadPool> map_pool,
                       std::unique_ptr<SplatEngine> engine)
    : config_(config),
      sensor_(sensor),
      track_pool_(std::move(track_pool)),
      map_pool_(std::move(map_pool)),
      tracker_(config.tracker, *track_pool_),
      held_out_stride_(config.system.held_out_interval),
      next_held_out_(held_out_stride_),
      mapper_(std::move(engine), sensor, config.mapper, *map_pool_),
      keyframes_(kKeyframeQueue) {
  const bool threaded = config_.system.schedule == Schedule::kThreaded;
  if (config_.loops.mode != LoopMode::kOff) {
    loops_ = std::make_unique<LoopWorker>(config_.loops.closer, threaded);
  }
  if (threaded) {
    mapper_thread_ = std::jthread([this] { MapperLoop(); });
  }
}

SlamSystem::~SlamSystem() { keyframes_.Close(); }

void SlamSystem::UsePoses(Trajectory poses, GivenPoses meaning) {
  given_poses_ = std::move(poses);
  if (meaning == GivenPoses::kExact) loops_.reset();
}

std::optional<ScanRecord> SlamSystem::Process(const Scan& scan) {
  COVSPLAT_CHECK(!finished_);
  const auto start = std::chrono::steady_clock::now();
  const std::shared_ptr<const RegistrationTarget> target = target_.Get();
  std::optional<TrackResult> result =
      given_poses_ ? tracker_.Follow(scan, *given_poses_, target.get())
                   : std::optional<TrackResult>(tracker_.Track(scan, target.get()));
  if (!result) return std::nullopt;
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start;

  ScanRecord record = MakeRecord(*result);
  const SE3& T_odom_sensor = result->tracked.T_odom_sensor;
  const std::shared_ptr<const SE3> T_map_odom = T_map_odom_.Get();
  record.T_map_sensor = T_map_odom ? *T_map_odom * T_odom_sensor : T_odom_sensor;
  path_.push_back({record.scan, T_odom_sensor});
  record.track_ms = elapsed.count();
  record.target_surfels = target ? target->Size() : 0;
  if (result->first) HandOver(std::move(*result->first), &record.times);
  if (result->is_keyframe) {
    HandOver(std::move(result->tracked), &record.times);
  } else if (!MaybeHoldOut(*result)) {
    AddToSweep(*result);
  }
  WaitForMap(record.support, record.times);
  record.gaussians = gaussians_;
  record.mapper_steps = mapper_steps_;
  ++scans_;
  return record;
}

void SlamSystem::HandOver(TrackedScan keyframe, StageTimes* times) {
  keyframe_scans_.push_back(keyframe.scan);
  keyframe.sweep = std::exchange(sweep_, {});
  if (config_.system.schedule == Schedule::kLockstep) {
    MapKeyframe(std::move(keyframe), *times);
    return;
  }
  const ScopedTimer timer(*times, "wait");
  keyframes_.Push(std::move(keyframe));
  // Without any map there is nothing to track the next scan against.
  target_.WaitFor([](const RegistrationTarget&) { return true; });
}

// Scans that leave the map are followed by one that is tracked badly or lost, unless the keyframes
// that are on their way to the mapper are waited for.
void SlamSystem::WaitForMap(double support, StageTimes& times) {
  if (config_.system.schedule == Schedule::kLockstep || keyframe_scans_.empty()) return;
  if (support >= config_.tracker.keyframe.wait_support) return;
  const ScopedTimer timer(times, "wait");
  const auto all = static_cast<int>(keyframe_scans_.size());
  target_.WaitFor([&](const RegistrationTarget& target) { return target.Keyframes() >= all; });
}

// One keyframe's way through the mapper; the target is published as soon as it holds the keyframe,
// and again once it has been optimised, unless the next keyframe waits for its turn.
void SlamSystem::MapKeyframe(TrackedScan tracked, StageTimes& times) {
  if (loops_) {
    const ScopedTimer timer(times, "loops");
    loops_->Post(
        LoopKeyframeOf(mapper_.Map().Keyframes(), tracked, config_.loops.closer.check.voxel_m));
  }
  {
    const ScopedTimer timer(times, "keyframe");
    T_odom_newest_ = tracked.T_odom_sensor;
    mapper_.Insert(MakeKeyframe(
        std::move(tracked), sensor_, config_.system.max_surface_distance_m, *map_pool_));
  }
  if (config_.loops.mode == LoopMode::kOn) Correct();
  if (config_.system.schedule == Schedule::kThreaded) PublishTarget();
  if (keyframes_.Empty()) {  // as always in lockstep
    mapper_.OptimizeNewest();
    PublishTarget();
  } else {
    mapper_.OptimizeHurriedly();
  }
  AddTimes(times, mapper_.TakeTimes());
}

void SlamSystem::Correct() {
  if (!loops_) return;
  const std::optional<std::vector<SE3>> T_map_keyframe = loops_->TakeCorrection();
  if (!T_map_keyframe) return;
  mapper_.Correct(*T_map_keyframe);
  T_map_odom_.Publish(std::make_shared<const SE3>(*mapper_.OdomPose()));
}

// Loops are known to centimetres; the surfaces that two passes share say more.
void SlamSystem::StitchPasses() {
  const LoopsConfig& config = config_.loops;
  if (!loops_ || !config.stitch.enabled || !loops_->Closer().HasLoops()) return;
  const ScopedTimer timer(mapper_times_, "stitch");
  PoseGraph graph = loops_->Closer().Graph();
  const std::vector<AnchoredSurfel> surfels = SurfelsOf(std::as_const(mapper_).Map());
  const std::vector<double> way_m = WaysAlong(graph.T_map_node);
  const std::size_t known = graph.edges.size();
  for (int round = 0; round < config.stitch.rounds; ++round) {
    graph.edges.resize(known);
    std::ranges::move(StitchEdges(surfels,
                                  graph.T_map_node,
                                  way_m,
                                  config.closer.search.min_way_m,
                                  config.stitch,
                                  *map_pool_),
                      std::back_inserter(graph.edges));
    graph.T_map_node = Optimize(graph, config.closer.graph).T_map_node;
  }
  mapper_.Correct(graph.T_map_node);
}

void SlamSystem::PublishTarget() {
  gaussians_ = mapper_.Map().Size();
  mapper_steps_ = mapper_.Steps();
  target_.Publish(mapper_.MakeTarget(T_odom_newest_));
}

void SlamSystem::MapperLoop() {
  int idle_visits = 0;
  bool has_work = false;  // besides keyframes
  while (true) {
    std::optional<TrackedScan> keyframe = has_work ? keyframes_.TryPop() : keyframes_.Pop();
    if (keyframe) {
      MapKeyframe(std::move(*keyframe), mapper_times_);
      has_work = config_.mapper.IsRefined();
      continue;
    }
    if (keyframes_.Closed()) return;
    has_work = mapper_.OptimizeIdle([this] { return !keyframes_.Empty() || keyframes_.Closed(); });
    if (config_.loops.mode == LoopMode::kOn) Correct();
    if (++idle_visits % kVisitsPerTarget == 0 || !has_work) PublishTarget();
    AddTimes(mapper_times_, mapper_.TakeTimes());
  }
}

bool SlamSystem::MaybeHoldOut(const TrackResult& result) {
  if (held_out_stride_ == 0 || result.state != TrackState::kTracking) return false;
  if (scans_ < next_held_out_) return false;
  held_out_.push_back({result.tracked.scan, ProjectScan(sensor_, result.tracked.points).range_m});
  next_held_out_ = scans_ + held_out_stride_;
  if (held_out_.size() < kMaxHeldOut) return true;
  // Long runs: keep every other one and take half as many from now on.
  std::vector<HeldOut> thinned;
  for (std::size_t i = 0; i < held_out_.size(); i += 2) thinned.push_back(std::move(held_out_[i]));
  held_out_ = std::move(thinned);
  held_out_stride_ *= 2;
  return true;
}

void SlamSystem::AddToSweep(TrackResult& result) {
  if (!config_.mapper.spawn.patches.enabled || result.state != TrackState::kTracking) return;
  TrackedScan& tracked = result.tracked;
  sweep_.push_back(
      {tracked.T_odom_sensor, std::move(tracked.points), std::move(tracked.intensity)});
}

void SlamSystem::Finish() {
  if (std::exchange(finished_, true)) return;
  StageTimes last_times;
  if (std::optional<TrackedScan> only = tracker_.TakePendingFirst()) {
    HandOver(std::move(*only), &last_times);
  }
  keyframes_.Close();
  if (mapper_thread_.joinable()) mapper_thread_.join();
  if (loops_) loops_->Finish();
  Correct();
  StitchPasses();
  AddTimes(mapper_times_, last_times);
  map_memory_ = {.gaussians_bytes = mapper_.Map().Bytes(),
                 .views_bytes = mapper_.Views().Bytes(),
                 .places_bytes = loops_ ? loops_->Closer().PlacesBytes() : 0};
  mapper_.Conclude();
  AddTimes(mapper_times_, mapper_.TakeTimes());
  gaussians_ = mapper_.Map().Size();
  mapper_steps_ = mapper_.Steps();
}

SE3 SlamSystem::OdometryPoseOf(std::int64_t scan) const {
  return std::ranges::lower_bound(path_, scan, {}, &OdometryPose::scan)->T_odom_sensor;
}

SE3 SlamSystem::PoseOf(std::int64_t scan) const {
  SE3 T_odom_scan = OdometryPoseOf(scan);
  if (!mapper_.OdomPose()) return T_odom_scan;
  const auto as_seen_from = [&](auto keyframe) {
    const SE3 T_keyframe_scan = OdometryPoseOf(*keyframe).Inverse() * T_odom_scan;
    const auto number = static_cast<int>(keyframe - keyframe_scans_.begin());
    return mapper_.Map().KeyframePose(number) * T_keyframe_scan;
  };
  const auto after = std::ranges::upper_bound(keyframe_scans_, scan);
  if (after == keyframe_scans_.begin()) return as_seen_from(after);
  const auto before = std::prev(after);
  if (after == keyframe_scans_.end()) return as_seen_from(before);
  const double share = static_cast<double>(scan - *before) / static_cast<double>(*after - *before);
  return Interpolate(as_seen_from(before), as_seen_from(after), share);
}

}  // namespace covsplat
