#include "apps/error_json.hpp"

#include <nlohmann/json.hpp>

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;

Json Statistics(const ErrorStatistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"max", s.max}};
}

Json Relative(const RelativeError& error) {
  return {{"pairs", error.pairs},
          {"translation_m", Statistics(error.translation_m)},
          {"rotation_deg", Statistics(error.rotation_deg)}};
}

Json Segment(const SegmentDrift& drift) {
  return {{"length_m", drift.length_m},
          {"segments", drift.segments},
          {"translation_percent", drift.translation_percent},
          {"rotation_deg_per_m", drift.rotation_deg_per_m}};
}

/// Null if no segment is long enough.
Json DriftJson(const Drift& drift) {
  if (drift.overall.segments == 0) return nullptr;
  Json json = Segment(drift.overall);
  json.erase("length_m");
  for (const SegmentDrift& length : drift.by_length) json["by_length"].push_back(Segment(length));
  return json;
}

}  // namespace

Json ErrorJson(const TrajectoryError& error) {
  return {{"matched", error.matched},
          {"interpolated", error.interpolated},
          {"without_truth", error.without_truth},
          {"outside_truth", error.outside_truth},
          {"not_finite", error.not_finite},
          {"matched_from_s", error.first_matched_s},
          {"matched_to_s", error.last_matched_s},
          {"ate_translation_m", Statistics(error.ate_translation_m)},
          {"ate_rotation_deg", Statistics(error.ate_rotation_deg)},
          {"rpe_by_pose", Relative(error.rpe_by_pose)},
          {"rpe_by_distance", Relative(error.rpe_by_distance)},
          {"drift_kitti", DriftJson(error.kitti_drift)},
          {"drift_short", DriftJson(error.short_drift)},
          {"estimate_length_m", error.estimate_length_m},
          {"truth_length_m", error.truth_length_m}};
}

}  // namespace covsplat
