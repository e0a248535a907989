// SlamConfig: every number of a run that a user may want to change.
#pragma once

#include <vector>

#include "covsplat/loops/loop_closer.hpp"
#include "covsplat/loops/stitch.hpp"
#include "covsplat/mapping/mapper.hpp"
#include "covsplat/slam/tracker.hpp"

namespace covsplat {

/// The sensor's image; what is left at 0 or empty is estimated from the first scans.
struct SensorConfig {
  std::vector<double> elevation_deg;
  int columns = 0;
  double min_range_m = 0.0;
  double max_range_m = 0.0;
  int max_columns = 1024;
  int estimate_scans = 5;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("elevation_deg",
            c.elevation_deg,
            Range{-90.0, 90.0},
            "elevation of every beam, top first; empty: estimated from the first scans");
    v.Field("columns",
            c.columns,
            Range{0, 16384},
            "columns of the range image over the full turn, a multiple of 4; 0: estimated");
    v.Field("min_range_m",
            c.min_range_m,
            Range{0.0, 100.0},
            "nearest return the map is made of; 0: preprocess.min_range_m");
    v.Field("max_range_m",
            c.max_range_m,
            Range{0.0, 1000.0},
            "farthest return the map is made of; 0: preprocess.max_range_m");
    v.Field("max_columns", c.max_columns, Range{64, 16384}, "estimate at most so many columns");
    v.Field("estimate_scans", c.estimate_scans, Range{1, 100}, "scans to estimate from");
  }
};

/// How tracking and mapping share time.
enum class Schedule {
  kThreaded,  ///< at the same time, each as fast as it can
  kLockstep,  ///< in turns with a fixed budget: the same output every time, for any thread count
};

template <>
struct EnumNames<Schedule> {
  static constexpr std::array<EnumName<Schedule>, 2> kNames{
      {{Schedule::kThreaded, "threaded"}, {Schedule::kLockstep, "lockstep"}}};
};

/// Whether places that are seen again correct the map.
enum class LoopMode {
  kOff,
  kOn,       ///< as soon as a loop is known
  kOffline,  ///< after the last scan
};

template <>
struct EnumNames<LoopMode> {
  static constexpr std::array<EnumName<LoopMode>, 3> kNames{
      {{LoopMode::kOff, "off"}, {LoopMode::kOn, "on"}, {LoopMode::kOffline, "offline"}}};
};

/// What poses that are given instead of tracked stand for.
enum class GivenPoses {
  kExact,     ///< the truth: loops change nothing
  kOdometry,  ///< what tracking would have found
};

struct LoopsConfig {
  LoopMode mode = LoopMode::kOn;
  LoopConfig closer;
  StitchConfig stitch;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("mode", c.mode, "when places that are seen again correct the map");
    LoopConfig::Visit(c.closer, v);
    v.Section("stitch", c.stitch, "passes of the same surfaces, refined against each other");
  }
};

struct SystemConfig {
  Schedule schedule = Schedule::kThreaded;
  Backend backend = Backend::kAuto;
  int threads = 0;
  int held_out_interval = 25;
  double max_surface_distance_m = 0.5;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("schedule", c.schedule, "how tracking and mapping share time");
    v.Field("backend", c.backend, "where the map is rendered and optimised");
    v.Field("threads", c.threads, Range{0, 1024}, "threads in all; 0: one per processor");
    v.Field("held_out_interval",
            c.held_out_interval,
            Range{0, 1000000},
            "every so many scans one that is no keyframe is kept to measure the map by; 0: none");
    v.Field("max_surface_distance_m",
            c.max_surface_distance_m,
            Range{0.01, 10.0},
            "a pixel farther from every source point has no known surface");
  }
};

struct SlamConfig {
  SensorConfig sensor;
  TrackerConfig tracker;
  MapperConfig mapper;
  LoopsConfig loops;
  SystemConfig system;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Section("sensor", c.sensor, "the sensor's image");
    v.Section("deskew", c.tracker.deskew, "when each point was measured");
    v.Section("preprocess", c.tracker.preprocess, "what of a scan is used");
    v.Section("gicp", c.tracker.gicp, "registration of scans to the map");
    v.Section("recovery", c.tracker.recovery, "when a scan counts as lost");
    v.Section("keyframe", c.tracker.keyframe, "which scans become keyframes");
    v.Section("mapping", c.mapper, "the Gaussian map");
    v.Section("loops", c.loops, "places that are seen again");
    v.Section("system", c.system, "threads and schedule");
  }
};

/// What the ranges of single fields cannot say: limits that are the wrong way round.
Result<void> CheckSlamConfig(const SlamConfig& config);

}  // namespace covsplat
