// Mapper: takes keyframes in, keeps the map, improves it. Synchronous; whoever owns it decides
// when.
#pragma once

#include <functional>

#include "covsplat/core/stage_times.hpp"
#include "covsplat/mapping/feedback.hpp"
#include "covsplat/mapping/manage.hpp"
#include "covsplat/mapping/reliability.hpp"
#include "covsplat/mapping/training_views.hpp"

namespace covsplat {

struct MapperConfig {
  bool IsRefined() const { return feedback.mode != FeedbackMode::kFrozen; }

  SpawnConfig spawn;
  FeedbackConfig feedback;
  ScheduleConfig schedule;
  EngineConfig engine;
  ReliabilityConfig reliability;
  ManageConfig manage;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Section("spawn", c.spawn, "new Gaussians from keyframes");
    v.Section("feedback", c.feedback, "what tracking gets from the map");
    v.Section("schedule", c.schedule, "which views are optimised, and how long");
    v.Section("engine", c.engine, "rendering and optimisation");
    v.Section("reliability", c.reliability, "what stands still");
    v.Section("manage", c.manage, "what keeps the map small");
  }
};

class Mapper {
 public:
  Mapper(std::unique_ptr<SplatEngine> engine,
         const SensorModel& sensor,
         const MapperConfig& config,
         ThreadPool& pool);

  /// Spawns Gaussians where the map does not explain the keyframe and makes it a training view.
  /// Every few keyframes the map around it is managed.
  void Insert(Keyframe keyframe);

  /// The fixed budget of the newest keyframe: new, near and old views.
  void OptimizeNewest();
  /// The few steps there is time for while more keyframes wait.
  void OptimizeHurriedly();
  /// One visit of the view with most to gain, for idle time; cut short when `stop` says so. False
  /// if there is none that more steps would do good.
  bool OptimizeIdle(const std::function<bool()>& stop = [] { return false; });
  /// When the recording has ended: a last round of management, and `schedule.final_steps`. Views
  /// are then given up.
  void Conclude();

  /// The registration target around a pose, in the frame of odometry.
  std::shared_ptr<const RegistrationTarget> MakeTarget(const SE3& T_odom_sensor);

  /// Moves the first keyframes with all their Gaussians to where loops have them, and those that
  /// are newer along with the last of them. The frame of odometry moves in the map as the newest
  /// keyframe does, so that where scans are tracked nothing jumps.
  void Correct(std::span<const SE3> T_map_keyframe);
  /// T_map_odom; nothing until then: both frames are the same.
  const std::optional<SE3>& OdomPose() const { return T_map_odom_; }

  const GaussianMap& Map() const { return map_; }
  /// What the map, or the map as it was spawned, looks like from a pose.
  RenderOutput Render(const SE3& T_map_sensor) { return map_.Engine().Render(T_map_sensor); }

  std::int64_t Steps() const { return steps_; }
  /// Keyframes whose measurements are still there to optimise by, and what was done by all.
  const TrainingViews& Views() const { return views_; }
  /// Time since the last call, by stage.
  StageTimes TakeTimes() { return std::exchange(times_, {}); }

 private:
  void MaskMoved(Keyframe& keyframe);
  PatchFit FindPatches(const Keyframe& keyframe, const NearGaussians& near) const;
  void Spawn(const Keyframe& keyframe);
  void Manage();
  void JoinPasses();
  void Visit(
      int keyframe, int steps, const std::function<bool()>& stop = [] { return false; });

  const SensorModel sensor_;
  const MapperConfig config_;
  ThreadPool& pool_;
  GaussianMap map_;
  FreeSpace free_space_;
  TrainingViews views_;
  std::int64_t steps_ = 0;
  StageTimes times_;
  std::optional<SE3> T_map_odom_;
  SE3 T_odom_newest_;  ///< of the newest keyframe
};

}  // namespace covsplat
