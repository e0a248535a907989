// GaussianMap: the engine's Gaussians together with what tracking knows about each.
#pragma once

#include <memory>

#include "covsplat/mapping/spawn.hpp"

namespace covsplat {

/// Per-Gaussian signals, one row per row of the engine's table.
struct GaussianSignals {
  std::vector<float> confidence;        ///< u
  std::vector<float> control_score;     ///< c, NaN where unknown
  std::vector<int> last_seen;           ///< keyframe whose scan last agreed with the Gaussian (k_i)
  std::vector<std::uint8_t> trackable;  ///< m_i

  void Resize(std::size_t size);
};

/// One owner, one thread. Keyframes are the engine's anchors, numbered alike.
class GaussianMap {
 public:
  explicit GaussianMap(std::unique_ptr<SplatEngine> engine) : engine_(std::move(engine)) {}

  /// Adds a keyframe with its new Gaussians and makes its measurement a training view. Returns the
  /// keyframe's number.
  int AddKeyframe(const Keyframe& keyframe, const SpawnedGaussians& spawned);

  /// Updates `last_seen` of all Gaussians that a keyframe's range image shows where they are.
  void MarkSeen(int keyframe_number, const Keyframe& keyframe, const SensorModel& sensor);

  /// Removes Gaussians below an opacity (or no longer finite); returns how many went.
  std::size_t PruneOpacity(double min_opacity);

  /// Means within a distance of a pose, in its frame.
  std::vector<Eigen::Vector3f> MeansNear(const SE3& T_map_sensor, double distance_m) const;

  /// Gaussians in the map, padding not counted.
  std::size_t Size() const;
  int Keyframes() const { return static_cast<int>(engine_->AnchorPoses().size()); }
  const SE3& KeyframePose(int keyframe) const {
    return engine_->AnchorPoses()[static_cast<std::size_t>(keyframe)];
  }

  SplatEngine& Engine() { return *engine_; }
  const SplatEngine& Engine() const { return *engine_; }
  const GaussianSignals& Signals() const { return signals_; }
  /// The surviving Gaussians as they were spawned, row by row: what optimisation started from.
  const GaussianColumns<float>& AsSpawned() const { return as_spawned_; }

 private:
  std::unique_ptr<SplatEngine> engine_;
  GaussianSignals signals_;
  GaussianColumns<float> as_spawned_;
};

}  // namespace covsplat
