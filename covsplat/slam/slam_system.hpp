// SlamSystem: tracker and mapper wired together, in two threads or in lockstep.
#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "covsplat/core/sync.hpp"
#include "covsplat/slam/loop_worker.hpp"
#include "covsplat/slam/slam_config.hpp"

namespace covsplat {

/// What became of one scan, for logs and reports.
struct ScanRecord {
  std::int64_t scan = 0;
  double stamp_s = 0.0;  ///< mid scan: the time of the pose
  SE3 T_map_sensor;      ///< as known then; SlamSystem::PoseOf has what loops made of it
  TrackState state = TrackState::kInitializing;
  bool is_keyframe = false;
  std::size_t points = 0;
  std::size_t not_finite = 0;
  std::size_t out_of_range = 0;
  bool has_time = false;
  std::size_t source_points = 0;
  std::size_t correspondences = 0;
  double inlier_ratio = 0.0;
  double overlap = 0.0;
  double support = 1.0;
  double rms_residual_m = 0.0;
  int iterations = 0;
  int degenerate_directions = 0;
  std::size_t gaussians = 0;       ///< in the map when the scan was done
  std::size_t target_surfels = 0;  ///< of the target it was registered to
  std::int64_t mapper_steps = 0;   ///< optimiser steps so far
  double track_ms = 0.0;           ///< scan in to pose out
  StageTimes times;                ///< of the tracker, and in lockstep of the mapper
};

/// What of the map grows with the way, in bytes.
struct MapMemory {
  std::size_t gaussians_bytes = 0;  ///< with what optimisation and tracking know of them
  std::size_t views_bytes = 0;
  std::size_t places_bytes = 0;  ///< to be known again
};

/// A scan kept out of the map to measure it by.
struct HeldOut {
  std::int64_t scan = 0;
  Image<float> range_m;
};

/// Use: Process every scan, then Finish once; then the map is at rest and may be read. One calling
/// thread, which is the tracker's.
class SlamSystem {
 public:
  static Result<std::unique_ptr<SlamSystem>> Create(const SlamConfig& config,
                                                    const SensorModel& sensor);
  ~SlamSystem();

  /// Maps with these poses instead of tracking; scans without one are skipped. Before the first
  /// scan.
  void UsePoses(Trajectory poses, GivenPoses meaning);

  /// Tracks a scan and hands it to the mapper if it is a keyframe. Nothing if it has no given pose.
  /// Not after Finish.
  std::optional<ScanRecord> Process(const Scan& scan);

  /// Waits for the mapper and lets it do its last steps.
  void Finish();

  const Mapper& GetMapper() const { return mapper_; }
  Mapper& GetMapper() { return mapper_; }
  const SensorModel& Sensor() const { return sensor_; }
  const std::vector<HeldOut>& HeldOuts() const { return held_out_; }
  /// T_map_sensor of a processed scan; after Finish. Loops have moved it with the keyframes before
  /// and after it.
  SE3 PoseOf(std::int64_t scan) const;
  /// What became of the places that were looked at as loops, and the pose graph; after Finish.
  /// Null if loops are off.
  const LoopCloser* Loops() const { return loops_ ? &loops_->Closer() : nullptr; }
  const std::vector<std::int64_t>& KeyframeScans() const { return keyframe_scans_; }
  /// Time the mapper spent per stage; after Finish.
  const StageTimes& MapperTimes() const { return mapper_times_; }
  /// After Finish.
  const MapMemory& MemoryOfMap() const { return map_memory_; }

 private:
  struct OdometryPose {
    std::int64_t scan;
    SE3 T_odom_sensor;
  };

  SlamSystem(const SlamConfig& config,
             const SensorModel& sensor,
             std::unique_ptr<ThreadPool> track_pool,
             std::unique_ptr<ThreadPool> map_pool,
             std::unique_ptr<SplatEngine> engine);

  void HandOver(TrackedScan keyframe, StageTimes* times);
  void WaitForMap(double support, StageTimes& times);
  void MapKeyframe(TrackedScan keyframe, StageTimes& times);
  void MapperLoop();
  void Correct();
  void StitchPasses();
  void PublishTarget();
  SE3 OdometryPoseOf(std::int64_t scan) const;
  bool MaybeHoldOut(const TrackResult& result);
  void AddToSweep(TrackResult& result);

  // Constant after construction.
  const SlamConfig config_;
  const SensorModel sensor_;
  const std::unique_ptr<ThreadPool> track_pool_;
  const std::unique_ptr<ThreadPool> map_pool_;

  // Owned by the calling thread.
  Tracker tracker_;
  std::optional<Trajectory> given_poses_;
  std::vector<HeldOut> held_out_;
  std::vector<SweptScan> sweep_;    ///< scans since the last keyframe
  std::vector<OdometryPose> path_;  ///< of every processed scan
  std::vector<std::int64_t> keyframe_scans_;
  std::int64_t scans_ = 0;
  int held_out_stride_;
  std::int64_t next_held_out_;
  bool finished_ = false;

  // Owned by the mapper thread while it runs, by the calling thread otherwise.
  Mapper mapper_;
  StageTimes mapper_times_;
  MapMemory map_memory_;
  SE3 T_odom_newest_;                  ///< of the newest keyframe
  std::unique_ptr<LoopWorker> loops_;  ///< null if off

  // Where the two threads meet.
  BoundedQueue<TrackedScan> keyframes_;
  Latest<RegistrationTarget> target_;
  Latest<SE3> T_map_odom_;  ///< null until a loop was closed
  std::atomic<std::size_t> gaussians_{0};
  std::atomic<std::int64_t> mapper_steps_{0};

  std::jthread mapper_thread_;  // last: joins before the rest goes
};

}  // namespace covsplat
