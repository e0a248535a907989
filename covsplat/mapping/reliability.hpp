// Reliability: measurements where there was nothing a moment ago are of things that move.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/mapping/keyframe.hpp"

namespace covsplat {

struct ReliabilityConfig {
  bool enabled = true;
  int keyframes = 5;
  int min_seen_through = 3;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("enabled",
            c.enabled,
            "leave out what stands where the newest keyframes have seen through; off: all that is "
            "measured makes and trains Gaussians");
    v.Field("keyframes", c.keyframes, Range{1, 100}, "so many of the newest are asked");
    v.Field("min_seen_through",
            c.min_seen_through,
            Range{1, 100},
            "so many of them, and more than have seen it, must have seen through a place");
  }
};

/// What the newest keyframes have seen through, in the frame of odometry, in which they lie to each
/// other as they were tracked. Ours: the paper claims a reliability mask without
/// saying how it is made.
class FreeSpace {
 public:
  FreeSpace(const SensorModel& sensor, const ReliabilityConfig& config)
      : sensor_(sensor), config_(config) {}

  /// A keyframe as it was measured, nothing masked.
  void Remember(const Keyframe& keyframe);

  /// [points] whether each is where the remembered keyframes say there is nothing.
  std::vector<std::uint8_t> FindMoved(std::span<const Eigen::Vector3f> points,
                                      const SE3& T_odom_points,
                                      ThreadPool& pool) const;

 private:
  struct Sight {
    SE3 T_sensor_odom;
    Image<float> range_m;
  };

  const SensorModel sensor_;
  const ReliabilityConfig config_;
  std::deque<Sight> sights_;  ///< oldest first
};

/// Takes surfaces, by index of `tracked.surface`, out of a keyframe: pixels on them are as if there
/// had been no return.
void MaskSurfaces(std::span<const std::uint8_t> masked, Keyframe& keyframe);

}  // namespace covsplat
