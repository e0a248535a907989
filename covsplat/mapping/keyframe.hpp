// Keyframe: a tracked scan as the map needs it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "covsplat/core/config_field.hpp"
#include "covsplat/core/range_image.hpp"
#include "covsplat/mapping/patches.hpp"
#include "covsplat/registration/degeneracy.hpp"
#include "covsplat/registration/preprocess.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// Of a scan that is no keyframe, what the next keyframe takes along.
struct SweptScan {
  SE3 T_odom_sensor;
  std::vector<Eigen::Vector3f> points;  ///< all points, deskewed, sensor frame at mid scan, m
  std::vector<float> intensity = {};    ///< of each, or empty
};

/// A scan with its pose: everything that crosses from tracking to mapping. All vectors are in the
/// sensor frame at mid scan. Its pose is in the frame of odometry, in which the way that was
/// tracked has no jumps; loops move that frame in the map.
struct TrackedScan {
  std::int64_t scan = 0;  ///< ordinal in the run
  double stamp_s = 0.0;   ///< mid scan
  SE3 T_odom_sensor;
  std::vector<Eigen::Vector3f> points;      ///< all usable points, deskewed, m
  std::vector<float> intensity;             ///< of each, or empty
  std::vector<Eigen::Vector3f> surface;     ///< [S] deskewed source points of the registration, m
  std::vector<PointCovariance> covariance;  ///< [S] the surface around each
  std::vector<float> squared_distance;      ///< [S] m^2 to the target, infinity where unmatched
  std::vector<SweptScan> sweep;             ///< of a keyframe: the scans since the one before
  PoseKnowledge knowledge;                  ///< of its pose
};

/// A tracked scan on the sensor's image grid, with the surface each pixel lies on.
struct Keyframe {
  TrackedScan tracked;
  RangeMeasurement measurement;
  Image<int> point;                  ///< index into tracked.points, -1 where there is no return
  Image<int> surface;                ///< index into tracked.surface, -1 where it is unknown
  std::vector<float> control_score;  ///< [S] c, NaN where unknown
  /// Nothing until a loop was closed: till then both frames are the same.
  std::optional<SE3> T_map_odom = std::nullopt;

  SE3 ToMap(const SE3& T_odom_any) const {
    return T_map_odom ? *T_map_odom * T_odom_any : T_odom_any;
  }
  SE3 PoseInMap() const { return ToMap(tracked.T_odom_sensor); }
};

struct KeyframeConfig {
  double max_distance_m = 2.0;
  double max_angle_deg = 20.0;
  double busy_factor = 2.0;
  double min_overlap = 0.8;
  double min_support = 0.85;
  double wait_support = 0.85;
  double overlap_distance_m = 0.6;
  int max_scans = 20;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field(
        "max_distance_m", c.max_distance_m, Range{0.01, 100.0}, "a keyframe after moving this far");
    v.Field("max_angle_deg", c.max_angle_deg, Range{1.0, 360.0}, "... or turning this much");
    v.Field("busy_factor",
            c.busy_factor,
            Range{1.0, 10.0},
            "... both so many times as far while two keyframes or more wait to be mapped (threaded "
            "only)");
    v.Field("min_overlap",
            c.min_overlap,
            Range{0.0, 1.0},
            "... or when less than this share of the scan is near the map");
    v.Field("min_support",
            c.min_support,
            Range{0.0, 1.0},
            "... or when it has less than this share of the inliers that the first scan after the "
            "last keyframe had");
    v.Field("wait_support",
            c.wait_support,
            Range{0.0, 1.0},
            "tracking waits for keyframes on their way to the map while a scan has less than this "
            "share of the inliers that scans lately had");
    v.Field("overlap_distance_m",
            c.overlap_distance_m,
            Range{0.01, 10.0},
            "nearer than this to a Gaussian's mean counts as overlap");
    v.Field("max_scans", c.max_scans, Range{1, 100000}, "... or after so many scans");
  }
};

/// Share of the source points that lie on the map.
double Overlap(std::span<const float> squared_distance, double overlap_distance_m);

/// Projects a tracked scan and gives every pixel the surface (and so the normal) of the source
/// point next to it, if there is one within `max_surface_distance_m`. There, ranges are those at
/// which the pixel's own ray meets the surface.
Keyframe MakeKeyframe(TrackedScan tracked,
                      const SensorModel& sensor,
                      double max_surface_distance_m,
                      ThreadPool& pool);

/// Whether a pixel of measured ranges shows what is at a range: within 0.1 m and 2 %.
bool Sees(const Image<float>& measured_m, Pixel pixel, float range_m);

/// Whether a pixel shows a surface that a point in the sensor frame lies on, to within a distance.
bool LiesOnSurface(const RangeMeasurement& measurement,
                   const SensorModel& sensor,
                   Pixel pixel,
                   const Eigen::Vector3f& point,
                   float distance_m);

/// Whether measured ranges are beyond a range in a pixel, and nowhere near it in the pixels around:
/// there was nothing.
bool SeesThrough(const Image<float>& measured_m, Pixel pixel, float range_m);

}  // namespace covsplat
