#include "covsplat/slam/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace covsplat {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kBootstrapRounds = 3;
constexpr double kMaxPoseGapS = 0.5;
// Per scan, of the inlier ratio that is usual and of the best.
constexpr double kForget = 0.1;
constexpr double kForgetBest = 0.01;
constexpr int kBusyKeyframes = 2;
constexpr std::size_t kSearchPoints = 1500;
constexpr int kSearchIterations = 20;

/// A deskewed source cloud as the target of the next scan, while there are no Gaussians.
RegistrationTarget TargetOf(const SourceCloud& source, const ScanMotion& motion) {
  const std::vector<Eigen::Vector3f> points = Deskew(source.points, source.phase, motion);
  std::vector<TargetSurfel> surfels(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PointCovariance& covariance = source.covariance[i];
    surfels[i].mean = points[i];
    surfels[i].rotation = Eigen::Quaternionf(covariance.axes);
    surfels[i].scale0 = covariance.sigma_m[0];
    surfels[i].scale1 = covariance.sigma_m[1];
  }
  return {surfels, Eigen::Vector3d::Zero(), 0};
}

SourceCloud EveryNth(const SourceCloud& source, std::size_t stride) {
  SourceCloud part;
  part.duration_s = source.duration_s;
  for (std::size_t i = 0; i < source.Size(); i += stride) {
    part.points.push_back(source.points[i]);
    part.phase.push_back(source.phase[i]);
    part.scan_index.push_back(source.scan_index[i]);
    part.covariance.push_back(source.covariance[i]);
  }
  return part;
}

/// Rotation vectors to begin a search from, none first.
std::vector<Eigen::Vector3d> SearchTurns(double angle_rad) {
  std::vector<Eigen::Vector3d> turns = {Eigen::Vector3d::Zero()};
  for (const double sign : {1.0, -1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      turns.push_back(sign * angle_rad * Eigen::Vector3d::Unit(axis));
    }
    turns.push_back(2.0 * sign * angle_rad * Eigen::Vector3d::UnitZ());
  }
  return turns;
}

TrackerConfig WithMotionModel(TrackerConfig config) {
  config.gicp.motion_model = config.deskew.refine;
  return config;
}

PoseKnowledge KnowledgeOf(const AlignResult& align) {
  if (align.correspondences == 0) return {};
  return {WithoutDirections(align.information, align.weak), align.degenerate_directions > 0};
}

/// The motion within a scan if the sensor went on evenly from one mid-scan pose to the next.
Vector6d TwistBetween(const SE3& T_from, const SE3& T_to, double gap_s, double duration_s) {
  if (gap_s <= 0.0 || duration_s <= 0.0) return Vector6d::Zero();
  return (T_from.Inverse() * T_to).Log() * (duration_s / gap_s);
}

}  // namespace

Tracker::Tracker(const TrackerConfig& config, ThreadPool& pool)
    : config_(WithMotionModel(config)), pool_(pool) {}

TrackResult Tracker::Track(const Scan& scan, const RegistrationTarget* target) {
  TrackResult result;
  const ScanTiming timing = TimeScan(scan, config_.deskew);
  const MotionPrediction prediction = Predict(timing);
  const Prepared prepared = Prepare(scan, timing, prediction.motion, result);
  const double gap_s = timing.mid_stamp_s - last_stamp_s_;
  result.keyframes_waiting = KeyframesNotIn(target);

  if (!has_motion_ && !first_) {
    if (prepared.source.Size() > 0) first_ = FirstScan{scan, prepared};
    result.tracked = Deskewed(scan, prepared, {}, {});
    last_stamp_s_ = timing.mid_stamp_s;
    last_duration_s_ = timing.duration_s;
    return result;
  }
  {
    const ScopedTimer timer(result.times, "align");
    if (first_) {
      result.align = Bootstrap(prepared, result);
    } else if (target != nullptr) {
      result.align = Register(prepared.source, *target, prediction, gap_s);
    }
  }
  const bool tracked = IsPlausible(result.align, prediction, gap_s);
  result.state = tracked ? TrackState::kTracking : TrackState::kLost;
  Conclude(scan, prepared, tracked ? result.align.motion : prediction.motion, result);
  return result;
}

std::optional<TrackResult> Tracker::Follow(const Scan& scan,
                                           const Trajectory& poses,
                                           const RegistrationTarget* target) {
  TrackResult result;
  const ScanTiming timing = TimeScan(scan, config_.deskew);
  const std::optional<SE3> middle = PoseAt(poses, timing.mid_stamp_s, kMaxPoseGapS);
  if (!middle) return std::nullopt;
  ScanMotion motion;
  motion.T_map_sensor = *middle;
  const double half_s = 0.5 * timing.duration_s;
  const auto begin = PoseAt(poses, timing.mid_stamp_s - half_s, kMaxPoseGapS);
  const auto end = PoseAt(poses, timing.mid_stamp_s + half_s, kMaxPoseGapS);
  if (begin && end) motion.twist = (begin->Inverse() * *end).Log();
  const Prepared prepared = Prepare(scan, timing, motion, result);
  result.keyframes_waiting = KeyframesNotIn(target);
  result.state = TrackState::kTracking;
  result.align.motion = motion;
  result.align.converged = true;
  if (target != nullptr && target->Size() > 0) {
    const auto gate = static_cast<float>(config_.gicp.max_correspondence_m);
    for (const Eigen::Vector3f& p : Deskew(prepared.source.points, prepared.source.phase, motion)) {
      const Eigen::Vector3d p_map = motion.T_map_sensor * p.cast<double>();
      const auto match =
          target->Index().Nearest((p_map - target->OriginMap()).cast<float>(), gate * gate);
      result.align.squared_distance.push_back(match.squared_distance);
    }
  }
  Conclude(scan, prepared, motion, result);
  return result;
}

Tracker::Prepared Tracker::Prepare(const Scan& scan,
                                   const ScanTiming& timing,
                                   const ScanMotion& predicted,
                                   TrackResult& result) {
  const ScopedTimer timer(result.times, "preprocess");
  Prepared prepared{timing, Preprocess(scan, timing, predicted, config_.preprocess, pool_)};
  result.points = scan.points.size();
  result.not_finite = prepared.source.not_finite;
  result.out_of_range = prepared.source.out_of_range;
  result.has_time = !timing.phase.empty();
  return prepared;
}

MotionPrediction Tracker::Predict(const ScanTiming& timing) const {
  if (!has_motion_) return {};
  const double gap_s = timing.mid_stamp_s - last_stamp_s_;
  MotionPrediction prediction =
      PredictMotion(motion_, last_duration_s_, timing.duration_s, gap_s, motion_covariance_);
  prediction.horizon_s = timing.mid_stamp_s - last_tracked_s_;
  if (last_duration_s_ > 0.0 && timing.duration_s > 0.0) return prediction;
  // A scan taken at once has no motion within it: go on as between the last two.
  prediction.motion.T_map_sensor = motion_.T_map_sensor * SE3::Exp(gap_s * velocity_);
  return prediction;
}

// Until a map exists the first scan is the target. How it moved is only known once the second is
// registered to it, so the two take turns.
AlignResult Tracker::Bootstrap(const Prepared& second, TrackResult& result) {
  const double gap_s = second.timing.mid_stamp_s - first_->prepared.timing.mid_stamp_s;
  ScanMotion first_motion;
  AlignResult align;
  MotionPrediction prediction;
  for (int round = 0; round < kBootstrapRounds; ++round) {
    const RegistrationTarget target = TargetOf(first_->prepared.source, first_motion);
    align = Align(second.source, target, prediction, config_.gicp, pool_);
    if (!IsPlausible(align, {}, gap_s)) break;
    prediction.motion = align.motion;
    first_motion.twist =
        TwistBetween(SE3(), align.motion.T_map_sensor, gap_s, first_->prepared.timing.duration_s);
  }
  if (!IsPlausible(align, {}, gap_s)) first_motion = {};
  TrackResult again;
  const Prepared refined = Prepare(first_->scan, first_->prepared.timing, first_motion, again);
  result.first = Deskewed(first_->scan, refined, first_motion, {});
  CountKeyframe(SE3());
  first_.reset();
  return align;
}

AlignResult Tracker::Register(const SourceCloud& source,
                              const RegistrationTarget& target,
                              const MotionPrediction& prediction,
                              double gap_s) {
  const auto is_plausible = [&](const AlignResult& a) { return IsPlausible(a, prediction, gap_s); };
  AlignResult align = Align(source, target, prediction, config_.gicp, pool_);
  const double enough = config_.recovery.search_below * usual_inlier_ratio_;
  if (is_plausible(align) && align.inlier_ratio >= enough) return align;
  AlignResult found = Search(source, target, prediction, gap_s);
  if (!is_plausible(found)) return align;
  const bool better = !is_plausible(align) || found.inlier_ratio > align.inlier_ratio;
  return better ? found : align;
}

// A part of the scan is registered from standstill and from turns both ways about each axis; the
// whole scan goes on from where most of that part came to lie on the map.
AlignResult Tracker::Search(const SourceCloud& source,
                            const RegistrationTarget& target,
                            const MotionPrediction& prediction,
                            double gap_s) const {
  GicpConfig gicp = config_.gicp;
  gicp.max_correspondence_m *= config_.recovery.search_gate_factor;
  GicpConfig brief = gicp;
  brief.max_iterations = std::min(brief.max_iterations, kSearchIterations);
  const SourceCloud part =
      EveryNth(source, std::max<std::size_t>(1, source.Size() / kSearchPoints));
  MotionPrediction best;
  best.motion.T_map_sensor = motion_.T_map_sensor;
  double best_ratio = 0.0;
  for (const Eigen::Vector3d& turn : SearchTurns(config_.recovery.search_angle_deg * kDegree)) {
    Vector6d moved = Vector6d::Zero();
    moved.head<3>() = turn;
    MotionPrediction guess;
    guess.motion.T_map_sensor = motion_.T_map_sensor * SE3::Exp(moved);
    const AlignResult align = Align(part, target, guess, brief, pool_);
    if (!IsPlausible(align, prediction, gap_s) || align.inlier_ratio <= best_ratio) continue;
    best_ratio = align.inlier_ratio;
    best.motion = align.motion;
  }
  return Align(source, target, best, gicp, pool_);
}

bool Tracker::IsPlausible(const AlignResult& align,
                          const MotionPrediction& prediction,
                          double gap_s) const {
  const RecoveryConfig& limits = config_.recovery;
  if (align.correspondences == 0 || !align.motion.IsFinite()) return false;
  if (align.inlier_ratio < limits.min_inlier_ratio) return false;
  const SE3& T_map_sensor = align.motion.T_map_sensor;
  const Vector6d moved = (motion_.T_map_sensor.Inverse() * T_map_sensor).Log();
  const double off_m =
      (T_map_sensor.Translation() - prediction.motion.T_map_sensor.Translation()).norm();
  const double horizon_s = prediction.horizon_s;
  return moved.tail<3>().norm() <= limits.max_speed_mps * gap_s &&
         moved.head<3>().norm() <= limits.max_turn_rate_degps * kDegree * gap_s &&
         (horizon_s <= 0.0 || off_m <= limits.max_acceleration_mps2 * horizon_s * horizon_s);
}

TrackedScan Tracker::Deskewed(const Scan& scan,
                              const Prepared& prepared,
                              const ScanMotion& motion,
                              std::vector<float> squared_distance) const {
  TrackedScan tracked;
  tracked.scan = scan.index;
  tracked.stamp_s = prepared.timing.mid_stamp_s;
  tracked.T_odom_sensor = motion.T_map_sensor;
  const bool taken_at_once = prepared.timing.phase.empty();
  const PoseTable poses(taken_at_once ? ScanMotion{} : motion, Eigen::Matrix3d::Identity());
  tracked.points = Deskew(scan.points, prepared.timing.phase, poses);
  tracked.intensity = scan.intensity;
  tracked.surface = Deskew(prepared.source.points, prepared.source.phase, poses);
  tracked.covariance = prepared.source.covariance;
  tracked.squared_distance = std::move(squared_distance);
  if (taken_at_once) return tracked;
  for (std::size_t i = 0; i < tracked.covariance.size(); ++i) {
    Eigen::Matrix3f& axes = tracked.covariance[i].axes;
    axes = poses.At(prepared.source.phase[i]).rotation * axes;
  }
  return tracked;
}

// The only place where the tracker's state changes after a scan.
void Tracker::Conclude(const Scan& scan,
                       const Prepared& prepared,
                       const ScanMotion& motion,
                       TrackResult& result) {
  const ScopedTimer timer(result.times, "deskew");
  result.tracked = Deskewed(scan, prepared, motion, result.align.squared_distance);
  result.tracked.knowledge = KnowledgeOf(result.align);
  result.overlap = Overlap(result.align.squared_distance, config_.keyframe.overlap_distance_m);
  const double gap_s = prepared.timing.mid_stamp_s - last_stamp_s_;
  const bool knows_last = has_motion_ || result.first.has_value();
  if (knows_last && gap_s > 0.0 && result.state == TrackState::kTracking) {
    velocity_ = (motion_.T_map_sensor.Inverse() * motion.T_map_sensor).Log() / gap_s;
  }
  ScanMotion learnt = motion;
  if (config_.deskew.refine == MotionModel::kRigid && result.state == TrackState::kTracking) {
    learnt.twist =
        TwistBetween(motion_.T_map_sensor, motion.T_map_sensor, gap_s, prepared.timing.duration_s);
  }
  motion_ = learnt;
  has_motion_ = true;
  last_stamp_s_ = prepared.timing.mid_stamp_s;
  last_duration_s_ = prepared.timing.duration_s;
  ++scans_since_keyframe_;
  if (result.state == TrackState::kLost) {
    velocity_ *= 0.5;
    motion_.twist *= 0.5;  // a blind prediction is trusted less with every scan
    motion_.acceleration.setZero();
    return;
  }
  last_tracked_s_ = last_stamp_s_;
  motion_covariance_ = result.align.covariance;
  const double ratio = result.align.inlier_ratio;
  usual_inlier_ratio_ +=
      (usual_inlier_ratio_ > 0.0 ? kForget : 1.0) * (ratio - usual_inlier_ratio_);
  best_inlier_ratio_ += kForgetBest * (ratio - best_inlier_ratio_);
  best_inlier_ratio_ = std::max(best_inlier_ratio_, ratio);
  // Of given poses no inliers are known.
  if (best_inlier_ratio_ > 0.0) result.support = ratio / best_inlier_ratio_;
  const bool has_all = result.keyframes_waiting == 0 && !result.first;
  if (has_all && fresh_inlier_ratio_ == 0.0) fresh_inlier_ratio_ = ratio;
  result.is_keyframe = WantsKeyframe(result);
  if (result.is_keyframe) CountKeyframe(motion.T_map_sensor);
}

// Overlap with a target that lacks a keyframe would ask for that keyframe again. A mapper that has
// fallen behind gets fewer keyframes, not later ones: tracking needs the map where the sensor is.
bool Tracker::WantsKeyframe(const TrackResult& result) const {
  if (!T_odom_keyframe_) return true;
  const KeyframeConfig& policy = config_.keyframe;
  const Vector6d moved = (T_odom_keyframe_->Inverse() * result.tracked.T_odom_sensor).Log();
  const bool leaves_map = result.keyframes_waiting == 0 &&
                          (result.overlap < policy.min_overlap ||
                           result.align.inlier_ratio < policy.min_support * fresh_inlier_ratio_);
  const double stretch = result.keyframes_waiting >= kBusyKeyframes ? policy.busy_factor : 1.0;
  return moved.tail<3>().norm() > stretch * policy.max_distance_m ||
         moved.head<3>().norm() > stretch * policy.max_angle_deg * kDegree || leaves_map ||
         scans_since_keyframe_ >= policy.max_scans;
}

void Tracker::CountKeyframe(const SE3& T_odom_sensor) {
  T_odom_keyframe_ = T_odom_sensor;
  scans_since_keyframe_ = 0;
  fresh_inlier_ratio_ = 0.0;
  ++keyframes_;
}

int Tracker::KeyframesNotIn(const RegistrationTarget* target) const {
  return std::max(0, keyframes_ - (target != nullptr ? target->Keyframes() : 0));
}

std::optional<TrackedScan> Tracker::TakePendingFirst() {
  if (!first_) return std::nullopt;
  TrackedScan tracked = Deskewed(first_->scan, first_->prepared, {}, {});
  first_.reset();
  return tracked;
}

}  // namespace covsplat
