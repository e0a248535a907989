// Mapper: takes keyframes in, keeps the map, improves it. Synchronous; whoever owns it decides
// when.
#pragma once

#include "covsplat/core/rng.hpp"
#include "covsplat/core/stage_times.hpp"
#include "covsplat/mapping/feedback.hpp"
#include "covsplat/mapping/manage.hpp"
#include "covsplat/mapping/reliability.hpp"

namespace covsplat {

struct ScheduleConfig {
  int steps_new = 10;
  int steps_near = 10;
  int steps_old = 0;
  int steps_hurried = 3;
  int steps_per_visit = 10;
  int final_steps = 0;
  double view_spacing_m = 1.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("steps_new", c.steps_new, Range{0, 10000}, "optimiser steps on each new keyframe");
    v.Field(
        "steps_near", c.steps_near, Range{0, 10000}, "... then on one of the views nearest to it");
    v.Field("steps_old", c.steps_old, Range{0, 10000}, "... then on one of all views");
    v.Field("steps_hurried",
            c.steps_hurried,
            Range{0, 10000},
            "these on the newest instead of all that, while more keyframes wait (threaded only)");
    v.Field("steps_per_visit",
            c.steps_per_visit,
            Range{1, 1000},
            "steps on one view before idle time goes to another");
    v.Field("final_steps",
            c.final_steps,
            Range{0, 10000000},
            "steps over all views when the recording has ended");
    v.Field("view_spacing_m",
            c.view_spacing_m,
            Range{0.0, 100.0},
            "views nearer than this to another one are forgotten: memory is bounded by the places "
            "that were seen, not by time");
  }
};

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
  /// One visit of a view for idle time: the newest ones more often than old ones.
  void OptimizeIdle();
  /// When the recording has ended: a last round of management, and `schedule.final_steps`.
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
  /// Keyframes whose measurements are still there to optimise by; the last is the newest.
  std::vector<int> Views() const;
  /// Time since the last call, by stage.
  StageTimes TakeTimes() { return std::exchange(times_, {}); }

 private:
  struct View {
    int keyframe;
    double travelled_m;  ///< from the first keyframe to this one
  };

  double Distance(const View& a, const View& b) const;
  void MaskMoved(Keyframe& keyframe);
  PatchFit FindPatches(const Keyframe& keyframe, const NearGaussians& near) const;
  void Spawn(const Keyframe& keyframe);
  void AddView(int keyframe);
  void ThinViews();
  void Manage();
  void JoinPasses();
  void Visit(int keyframe, int steps);
  int RandomView();
  int RandomNearView();

  const SensorModel sensor_;
  const MapperConfig config_;
  ThreadPool& pool_;
  GaussianMap map_;
  FreeSpace free_space_;
  std::vector<View> views_;  ///< oldest first
  Rng rng_{20250711};
  std::int64_t steps_ = 0;
  StageTimes times_;
  std::optional<SE3> T_map_odom_;
  SE3 T_odom_newest_;  ///< of the newest keyframe
};

}  // namespace covsplat
