#include "covsplat/eval/surface_error.hpp"

#include <cmath>

#include "tests/eval/meshes.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/nearest_points.hpp"
#include "covsplat/core/rng.hpp"
#include "covsplat/eval/surface_samples.hpp"

namespace covsplat {
namespace {

using test::BoxMesh;
using test::Plane;

// Two sets of samples of the same plane are this far apart, on average and at most.
constexpr double kSamplingFloor = 0.006;
constexpr double kSamplingMax = 0.04;

std::vector<Eigen::Vector3d> Sampled(const TriangleMesh& mesh, std::uint64_t seed) {
  ThreadPool pool(2);
  SamplingOptions options;
  options.seed = seed;
  return SampleMesh(mesh, {}, options, pool);
}

SurfaceError PaperErrorOf(const TriangleMesh& result,
                          const TriangleMesh& truth,
                          std::vector<double> tau_m) {
  ThreadPool pool(2);
  SurfaceErrorOptions options;
  options.tau_m = std::move(tau_m);
  return PaperError(MeasureDistances(Sampled(result, 1), Sampled(truth, 2), pool), options);
}

// Of points d above or below a plane whose nearest sample is up to kSamplingMax aside.
void ExpectDistance(double actual_m, double d) {
  EXPECT_GE(actual_m, d - 1e-4);
  EXPECT_LE(actual_m, std::hypot(d, kSamplingFloor) + 1e-4);
}

TEST(SurfaceError, ParallelPlanesAreTheirDistanceApart) {
  const SurfaceError error =
      PaperErrorOf(Plane(0, 0, 3, 2, 0.1f), Plane(0, 0, 3, 2, 0.0f), {0.2, 0.09});
  ExpectDistance(error.accuracy_m, 0.1);
  ExpectDistance(error.completeness_m, 0.1);
  EXPECT_DOUBLE_EQ(error.chamfer_m, 0.5 * (error.accuracy_m + error.completeness_m));
  EXPECT_EQ(error.scores[0].f_score, 1.0);
  EXPECT_EQ(error.scores[1].precision, 0.0);
  EXPECT_EQ(error.scores[1].recall, 0.0);
  EXPECT_EQ(error.scores[1].f_score, 0.0);
}

TEST(SurfaceError, HalfOfAPlaneHasHalfTheRecall) {
  // The far half lies 0 to 2 m from the result; its first 0.2 m are within tau, and 1.2 m are
  // within the crop of the paper's protocol.
  const SurfaceError error = PaperErrorOf(Plane(0, 0, 2, 4, 0.0f), Plane(0, 0, 4, 4, 0.0f), {0.2});
  EXPECT_EQ(error.scores[0].precision, 1.0);
  EXPECT_NEAR(error.scores[0].recall, 2.2 / 3.2, 0.004);
  EXPECT_NEAR(error.truth_left_out, 0.8 / 4.0, 0.004);
  // Distances rise from 0 to 0.5 over half a metre and count 0.5 for the other 0.7 m.
  EXPECT_NEAR(error.completeness_m, (0.5 * 0.25 + 0.7 * 0.5) / 3.2, 0.006);
  const double p = error.scores[0].precision, r = error.scores[0].recall;
  EXPECT_DOUBLE_EQ(error.scores[0].f_score, 2 * p * r / (p + r));
}

TEST(SurfaceError, TheStrictProtocolCountsWhatThePaperCuts) {
  ThreadPool pool(2);
  TriangleMesh result = Plane(0, 0, 2, 4, 0.0f);
  test::AddQuad({0, 0, 3}, {2, 0, 0}, {0, 4, 0}, result);  // a ghost sheet 3 m up
  const auto result_points = Sampled(result, 1);
  const auto truth_points = Sampled(Plane(0, 0, 4, 4, 0.0f), 2);
  const SurfaceDistances distances = MeasureDistances(result_points, truth_points, pool);
  const SurfaceError paper = PaperError(distances, {});
  EXPECT_NEAR(paper.accuracy_m, 0.0, kSamplingFloor);
  EXPECT_EQ(paper.scores[0].precision, 1.0);
  EXPECT_NEAR(paper.result_left_out, 0.5, 0.01);

  const std::vector<std::uint8_t> all_of_result(result_points.size(), 1);
  const std::vector<std::uint8_t> all_of_truth(truth_points.size(), 1);
  const SurfaceError strict = StrictError(distances, all_of_result, all_of_truth, {});
  EXPECT_NEAR(strict.accuracy_m, 1.5, 0.01);
  EXPECT_NEAR(strict.scores[0].precision, 0.5, 0.01);
  EXPECT_NEAR(strict.scores[0].recall, 2.2 / 4.0, 0.004);
  EXPECT_EQ(strict.result_left_out, 0.0);
  EXPECT_EQ(strict.truth_left_out, 0.0);
}

TEST(SurfaceError, TheStrictProtocolJudgesWhatTheMasksName) {
  SurfaceDistances distances;
  distances.from_result_m = {0.1f, 7.0f, 0.3f};
  distances.from_truth_m = {0.0f, 9.0f};
  const std::vector<std::uint8_t> result = {1, 0, 1}, truth = {0, 1};
  const SurfaceError error = StrictError(distances, result, truth, {});
  EXPECT_EQ(error.result_points, 2u);
  EXPECT_EQ(error.truth_points, 1u);
  EXPECT_NEAR(error.accuracy_m, 0.2, 1e-7);
  EXPECT_EQ(error.completeness_m, 0.5);  // no more than the truncation
  EXPECT_EQ(error.scores[0].precision, 0.5);
  EXPECT_EQ(error.scores[0].recall, 0.0);
  EXPECT_NEAR(error.result_left_out, 1.0 / 3.0, 1e-12);
  EXPECT_EQ(error.truth_left_out, 0.5);
}

TEST(SurfaceError, AShiftedBoxIsOffByTheShiftOnTwoSidesOnly) {
  // Sides of 2 x 2 m: the two across the shift are 5 cm off, the other four overlap themselves.
  const SurfaceError error =
      PaperErrorOf(BoxMesh({0.05f, 0, 0}, {2, 2, 2}), BoxMesh({0, 0, 0}, {2, 2, 2}), {0.2, 0.04});
  EXPECT_GT(error.accuracy_m, 2.0 / 6.0 * 0.05);
  EXPECT_LT(error.accuracy_m, 2.0 / 6.0 * 0.05 + kSamplingFloor);
  EXPECT_EQ(error.scores[0].f_score, 1.0);
  EXPECT_NEAR(error.scores[1].precision, 4.0 / 6.0, 0.01);
  EXPECT_NEAR(error.scores[1].recall, 4.0 / 6.0, 0.01);
}

TEST(SurfaceError, NothingToJudgeGivesZeros) {
  const SurfaceError error = PaperError({}, {});
  EXPECT_EQ(error.accuracy_m, 0.0);
  EXPECT_EQ(error.scores[0].f_score, 0.0);
}

TEST(NearestPoints, FindsWhatBruteForceFindsForAnyNumberOfThreads) {
  Rng rng(5);
  const auto cloud = [&](int size) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < size; ++i) {
      points.emplace_back(rng.Normal(), rng.Normal(), 0.1 * rng.Normal());
    }
    return points;
  };
  const auto points = cloud(500);
  const auto queries = cloud(5000);
  ThreadPool one(1), three(3);
  const NearestPoints nearest(points);
  const std::vector<float> found = nearest.DistancesFrom(queries, one);
  EXPECT_EQ(found, nearest.DistancesFrom(queries, three));
  for (std::size_t i = 0; i < queries.size(); i += 10) {
    double least = 1e9;
    for (const Eigen::Vector3d& p : points) least = std::min(least, (p - queries[i]).norm());
    EXPECT_NEAR(found[i], least, 1e-7);
  }
  EXPECT_TRUE(std::isinf(NearestPoints({}).DistanceFrom({0, 0, 0})));
}

}  // namespace
}  // namespace covsplat
