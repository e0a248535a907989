// Mapper: takes keyframes in, keeps the map, improves it. Synchronous; whoever owns it decides
// when.
#pragma once

#include "covsplat/core/rng.hpp"
#include "covsplat/core/stage_times.hpp"
#include "covsplat/mapping/trackable.hpp"

namespace covsplat {

struct ScheduleConfig {
  int steps_new = 10;
  int steps_near = 10;
  int steps_old = 0;
  int steps_hurried = 3;
  int steps_per_visit = 10;
  int final_steps = 0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("steps_new", c.steps_new, Range{0, 10000}, "optimiser steps on each new keyframe");
    v.Field("steps_near",
            c.steps_near,
            Range{0, 10000},
            "... then on one of the keyframes nearest to it");
    v.Field("steps_old", c.steps_old, Range{0, 10000}, "... then on one of all keyframes");
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
            "steps over all keyframes when the recording has ended");
  }
};

struct MapperConfig {
  bool enabled = true;
  SpawnConfig spawn;
  TrackableConfig trackable;
  ScheduleConfig schedule;
  EngineConfig engine;
  double prune_opacity = 0.05;
  int prune_seen_through = 2;
  int prune_interval = 5;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("enabled",
            c.enabled,
            "optimise the map; off: Gaussians stay as they were spawned (an ablation)");
    v.Section("spawn", c.spawn, "new Gaussians from keyframes");
    v.Section("trackable", c.trackable, "which Gaussians scans are registered to");
    v.Section("schedule", c.schedule, "which views are optimised, and how long");
    v.Section("engine", c.engine, "rendering and optimisation");
    v.Field("prune_opacity",
            c.prune_opacity,
            Range{0.0, 0.9},
            "Gaussians that have become more transparent than this are removed");
    v.Field("prune_seen_through",
            c.prune_seen_through,
            Range{1, 1000000},
            "so are Gaussians that so many keyframes in a row have seen through");
    v.Field("prune_interval", c.prune_interval, Range{1, 100000}, "keyframes between prunings");
  }
};

class Mapper {
 public:
  Mapper(std::unique_ptr<SplatEngine> engine,
         const SensorModel& sensor,
         const MapperConfig& config,
         ThreadPool& pool);

  /// Spawns Gaussians where the map does not explain the keyframe and makes it a training view.
  void Insert(const Keyframe& keyframe);

  /// The fixed budget of the newest keyframe: new, near and old views.
  void OptimizeNewest();
  /// The few steps there is time for while more keyframes wait.
  void OptimizeHurriedly();
  /// One visit of a view for idle time: the newest ones more often than old ones.
  void OptimizeIdle();
  /// `schedule.final_steps` over all keyframes.
  void OptimizeFinally();

  /// The registration target around a pose.
  std::shared_ptr<const RegistrationTarget> MakeTarget(const SE3& T_map_sensor);

  const GaussianMap& Map() const { return map_; }
  /// What the map, or the map as it was spawned, looks like from a pose.
  RenderOutput Render(const SE3& T_map_sensor) { return map_.Engine().Render(T_map_sensor); }

  std::int64_t Steps() const { return steps_; }
  /// Time since the last call, by stage.
  StageTimes TakeTimes() { return std::exchange(times_, {}); }

 private:
  void Visit(int keyframe, int steps);
  int RandomNearKeyframe();

  const SensorModel sensor_;
  const MapperConfig config_;
  ThreadPool& pool_;
  GaussianMap map_;
  Rng rng_{20250711};
  std::int64_t steps_ = 0;
  StageTimes times_;
};

}  // namespace covsplat
