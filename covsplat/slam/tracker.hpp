// Tracker: where the sensor was during each scan. Synchronous, knows no threads.
#pragma once

#include <memory>
#include <optional>

#include "covsplat/core/stage_times.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/mapping/keyframe.hpp"
#include "covsplat/registration/deskew.hpp"
#include "covsplat/registration/gicp.hpp"

namespace covsplat {

enum class TrackState {
  kInitializing,  ///< no map yet
  kTracking,      ///< the scan was registered to the map
  kLost,          ///< it was not; the pose is a prediction and nothing goes into the map
};

struct RecoveryConfig {
  double min_inlier_ratio = 0.25;
  double max_speed_mps = 60.0;
  double max_acceleration_mps2 = 50.0;
  double max_turn_rate_degps = 720.0;
  double search_below = 0.75;
  double search_angle_deg = 15.0;
  double search_gate_factor = 2.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("min_inlier_ratio",
            c.min_inlier_ratio,
            Range{0.0, 1.0},
            "a scan is lost if less than this share of it lies on the map");
    v.Field("max_speed_mps",
            c.max_speed_mps,
            Range{0.1, 1000.0},
            "... or if it would have moved faster than this");
    v.Field("max_acceleration_mps2",
            c.max_acceleration_mps2,
            Range{0.1, 100000.0},
            "... or if it could only have got there by accelerating more than this");
    v.Field("max_turn_rate_degps",
            c.max_turn_rate_degps,
            Range{1.0, 36000.0},
            "... or turned faster than this");
    v.Field("search_below",
            c.search_below,
            Range{0.0, 1.0},
            "where less of a scan lies on the map than this share of what is usual, the pose is "
            "searched for around the last one");
    v.Field("search_angle_deg",
            c.search_angle_deg,
            Range{1.0, 90.0},
            "... by turns of this much about each axis, and twice as much about the vertical one");
    v.Field("search_gate_factor",
            c.search_gate_factor,
            Range{1.0, 20.0},
            "... with gicp.max_correspondence_m larger by this factor");
  }
};

struct TrackerConfig {
  DeskewConfig deskew;
  PreprocessConfig preprocess;
  GicpConfig gicp;
  RecoveryConfig recovery;
  KeyframeConfig keyframe;
};

/// What became of one scan.
struct TrackResult {
  TrackState state = TrackState::kInitializing;
  TrackedScan tracked;  ///< pose (a prediction when lost) and deskewed points
  AlignResult align;    ///< empty unless registered
  double overlap = 0.0;
  double support = 1.0;       ///< inliers as a share of the most that scans had lately
  int keyframes_waiting = 0;  ///< keyframes before this scan that the target did not hold yet
  bool is_keyframe = false;
  /// With the second usable scan: the first one again, deskewed with the motion found meanwhile.
  std::optional<TrackedScan> first;

  std::size_t points = 0;      ///< in the scan
  std::size_t not_finite = 0;  ///< dropped: NaN or infinite
  std::size_t out_of_range = 0;
  bool has_time = false;  ///< the points carry times, or they were derived
  StageTimes times;
};

/// What it takes for the map's frame is that of odometry: where targets are.
class Tracker {
 public:
  Tracker(const TrackerConfig& config, ThreadPool& pool);

  /// Registers a scan to the target; `target` may be null or empty until a map exists. Stamps must
  /// increase.
  TrackResult Track(const Scan& scan, const RegistrationTarget* target);

  /// Takes the pose from a trajectory instead. Nothing where it has none.
  std::optional<TrackResult> Follow(const Scan& scan,
                                    const Trajectory& poses,
                                    const RegistrationTarget* target);

  /// The only scan of a recording of one, as a keyframe.
  std::optional<TrackedScan> TakePendingFirst();

 private:
  struct Prepared {
    ScanTiming timing;
    SourceCloud source;
  };
  struct FirstScan {
    Scan scan;
    Prepared prepared;
  };

  Prepared Prepare(const Scan& scan,
                   const ScanTiming& timing,
                   const ScanMotion& predicted,
                   TrackResult& result);
  MotionPrediction Predict(const ScanTiming& timing) const;
  AlignResult Bootstrap(const Prepared& second, TrackResult& result);
  AlignResult Register(const SourceCloud& source,
                       const RegistrationTarget& target,
                       const MotionPrediction& prediction,
                       double gap_s);
  AlignResult Search(const SourceCloud& source,
                     const RegistrationTarget& target,
                     const MotionPrediction& prediction,
                     double gap_s) const;
  bool IsPlausible(const AlignResult& align,
                   const MotionPrediction& prediction,
                   double gap_s) const;
  TrackedScan Deskewed(const Scan& scan,
                       const Prepared& prepared,
                       const ScanMotion& motion,
                       std::vector<float> squared_distance) const;
  void Conclude(const Scan& scan,
                const Prepared& prepared,
                const ScanMotion& motion,
                TrackResult& result);
  bool WantsKeyframe(const TrackResult& result) const;
  void CountKeyframe(const SE3& T_odom_sensor);
  int KeyframesNotIn(const RegistrationTarget* target) const;

  const TrackerConfig config_;
  ThreadPool& pool_;

  std::optional<FirstScan> first_;  ///< until a second scan tells how it moved
  bool has_motion_ = false;
  ScanMotion motion_;  ///< of the last scan
  Matrix18d motion_covariance_ = Matrix18d::Zero();
  double last_stamp_s_ = 0.0;
  double last_tracked_s_ = 0.0;
  double last_duration_s_ = 0.0;
  Vector6d velocity_ = Vector6d::Zero();  ///< per second, from the last two tracked scans

  std::optional<SE3> T_odom_keyframe_;  ///< of the last keyframe
  int scans_since_keyframe_ = 0;
  int keyframes_ = 0;
  /// Of the first scan that was registered to a target with the last keyframe in it; 0: none yet.
  double fresh_inlier_ratio_ = 0.0;
  double usual_inlier_ratio_ = 0.0;  ///< mean over the last tracked scans
  double best_inlier_ratio_ = 0.0;   ///< highest, slowly forgotten
};

}  // namespace covsplat
