// Figures of evo and Open3D on the files of tests/golden/eval; `make oracles` makes them anew.
#include <algorithm>
#include <filesystem>
#include <numeric>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "covsplat/eval/surface.hpp"
#include "covsplat/eval/surface_error.hpp"
#include "covsplat/eval/trajectory_error.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

using Json = nlohmann::json;

constexpr double kAgrees = 1e-6;  // metres, degrees, centimetres or percent

std::filesystem::path Golden(const char* name) {
  return std::filesystem::path(COVSPLAT_GOLDEN) / "eval" / name;
}

Json References() { return Json::parse(ReadFile(Golden("references.json")).value()); }

void ExpectStatistics(const ErrorStatistics& actual, const Json& expected) {
  EXPECT_NEAR(actual.rmse, expected["rmse"].get<double>(), kAgrees);
  EXPECT_NEAR(actual.mean, expected["mean"].get<double>(), kAgrees);
  EXPECT_NEAR(actual.median, expected["median"].get<double>(), kAgrees);
  EXPECT_NEAR(actual.max, expected["max"].get<double>(), kAgrees);
}

void ExpectRelative(const RelativeError& actual, const Json& expected) {
  ExpectStatistics(actual.translation_m, expected["translation_m"]);
  ExpectStatistics(actual.rotation_deg, expected["rotation_deg"]);
}

TEST(Reference, TrajectoryErrorsAgreeWithEvo) {
  const Json expected = References()["trajectory"];
  TrajectoryErrorOptions options;
  options.rpe_distance_m = 5.0;
  const TrajectoryError error = EvaluateTrajectory(
      ReadTum(Golden("estimate.tum")).value(), ReadTum(Golden("truth.tum")).value(), options);
  EXPECT_EQ(error.matched, expected["matched"].get<std::size_t>());
  ExpectStatistics(error.ate_translation_m, expected["ate_translation_m"]);
  ExpectStatistics(error.ate_rotation_deg, expected["ate_rotation_deg"]);
  ExpectRelative(error.rpe_by_pose, expected["rpe_by_pose"]);
  ExpectRelative(error.rpe_by_distance, expected["rpe_by_distance_5m"]);
  const Json& drift = expected["drift_kitti"];
  const SegmentDrift& overall = error.kitti_drift.overall;
  EXPECT_EQ(overall.segments, drift["segments"].get<int>());
  EXPECT_NEAR(overall.translation_percent, drift["translation_percent"].get<double>(), kAgrees);
  EXPECT_NEAR(overall.rotation_deg_per_m, drift["rotation_deg_per_m"].get<double>(), kAgrees);
}

double MeanOf(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(Reference, DistancesBetweenCloudsAgreeWithOpen3d) {
  const Json expected = References()["map"]["raw"];
  const Surface result = LoadSurface(Golden("result.ply")).value();
  const Surface truth = LoadSurface(Golden("truth.ply")).value();
  ThreadPool pool(2);
  const SurfaceDistances distances = MeasureDistances(result.points, truth.points, pool);
  EXPECT_NEAR(
      MeanOf(distances.from_result_m), expected["mean_from_result_m"].get<double>(), kAgrees);
  EXPECT_NEAR(MeanOf(distances.from_truth_m), expected["mean_from_truth_m"].get<double>(), kAgrees);
  const auto max = std::max_element(distances.from_result_m.begin(), distances.from_result_m.end());
  EXPECT_NEAR(*max, expected["max_from_result_m"].get<double>(), kAgrees);
}

TEST(Reference, ThePapersProtocolOnThinnedCloudsAgreesWithOpen3d) {
  const Json references = References()["map"];
  const Json& expected = references["paper"];
  ThreadPool pool(2);
  SamplingOptions sampling;
  sampling.voxel_m = references["voxel_m"].get<double>();
  const auto points = [&](const char* name) {
    return PointsOf(LoadSurface(Golden(name)).value(), {}, sampling, pool).value();
  };
  SurfaceErrorOptions options;
  options.tau_m.clear();
  for (const Json& score : expected["scores"]) options.tau_m.push_back(score["tau_m"]);
  const SurfaceError error =
      PaperError(MeasureDistances(points("result.ply"), points("truth.ply"), pool), options);
  EXPECT_EQ(error.result_points, expected["result_points"].get<std::size_t>());
  EXPECT_EQ(error.truth_points, expected["truth_points"].get<std::size_t>());
  EXPECT_NEAR(100.0 * error.accuracy_m, expected["accuracy_cm"].get<double>(), kAgrees);
  EXPECT_NEAR(100.0 * error.completeness_m, expected["completeness_cm"].get<double>(), kAgrees);
  EXPECT_NEAR(100.0 * error.chamfer_m, expected["chamfer_l1_cm"].get<double>(), kAgrees);
  EXPECT_NEAR(
      100.0 * error.result_left_out, expected["result_left_out_percent"].get<double>(), kAgrees);
  for (std::size_t i = 0; i < error.scores.size(); ++i) {
    const Json& score = expected["scores"][i];
    EXPECT_NEAR(
        100.0 * error.scores[i].precision, score["precision_percent"].get<double>(), kAgrees);
    EXPECT_NEAR(100.0 * error.scores[i].recall, score["recall_percent"].get<double>(), kAgrees);
    EXPECT_NEAR(100.0 * error.scores[i].f_score, score["f_score_percent"].get<double>(), kAgrees);
  }
}

}  // namespace
}  // namespace covsplat
