// GaussianMap: the engine's Gaussians together with what tracking knows about each.
#pragma once

#include <memory>

#include "covsplat/core/parallel.hpp"
#include "covsplat/mapping/spawn.hpp"

namespace covsplat {

/// Some of a map's Gaussians.
struct NearGaussians {
  std::vector<Disc> discs;
  std::vector<std::size_t> row;  ///< of each, in the engine's table until that changes
  std::vector<int> keyframe;     ///< in whose frame each is kept
};

/// One owner, one thread. Keyframes are the engine's anchors, numbered alike.
class GaussianMap {
 public:
  GaussianMap(std::unique_ptr<SplatEngine> engine, ThreadPool& pool)
      : engine_(std::move(engine)), pool_(&pool) {}

  /// Adds a keyframe with its new Gaussians, which it has seen and which are trackable, and makes
  /// its measurement a training view. Returns the keyframe's number.
  int AddKeyframe(const Keyframe& keyframe, const SpawnedGaussians& spawned);

  /// Adds Gaussians, with all their signals, in the frame of a keyframe that the map has.
  void Append(int keyframe, const SpawnedGaussians& fresh);

  /// Updates `last_seen` of all Gaussians that a keyframe's range image shows where they are, and
  /// `seen_through` of those where it shows something beyond. After a long way the map may lie
  /// elsewhere than the keyframe: Gaussians that `max_age` keyframes have not seen are seen again
  /// only where they lie on the surface that is measured, or tracking would be torn between them
  /// and newer ones, and count as seen through only if nearly all of the map that is so old is
  /// where it was.
  /// Returns the rows of the engine's table that it has seen through.
  std::vector<std::size_t> MarkSeen(int keyframe_number,
                                    const Keyframe& keyframe,
                                    const SensorModel& sensor,
                                    int max_age);

  /// Removes Gaussians below an opacity (or no longer finite); returns how many went.
  std::size_t PruneOpacity(double min_opacity);
  /// Removes those of some rows that so many keyframes have seen through: what they show has moved
  /// on.
  std::size_t PruneSeenThrough(std::span<const std::size_t> rows, int keyframes);

  /// Gaussians whose means are within a distance of a pose, in its frame; none that is not finite.
  NearGaussians Near(const SE3& T_map_sensor, double distance_m) const;
  /// Removes rows of the engine's table; returns how many went.
  std::size_t Remove(std::span<const std::size_t> rows);

  /// Gaussians in the map, padding not counted.
  std::size_t Size() const;
  /// Memory of all Gaussians: twice their parameters, Adam's memory and the signals.
  std::size_t Bytes() const;
  int Keyframes() const { return static_cast<int>(engine_->AnchorPoses().size()); }
  const SE3& KeyframePose(int keyframe) const {
    return engine_->AnchorPoses()[static_cast<std::size_t>(keyframe)];
  }

  SplatEngine& Engine() { return *engine_; }
  const SplatEngine& Engine() const { return *engine_; }
  /// Row by row of the engine's table.
  const std::vector<GaussianSignals>& Signals() const { return signals_; }
  /// The surviving Gaussians as they were spawned, row by row: what optimisation started from.
  const GaussianColumns<float>& AsSpawned() const { return as_spawned_; }

 private:
  std::unique_ptr<SplatEngine> engine_;
  ThreadPool* pool_;
  std::vector<GaussianSignals> signals_;
  GaussianColumns<float> as_spawned_;
};

}  // namespace covsplat
