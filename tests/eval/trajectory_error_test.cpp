#include "covsplat/eval/trajectory_error.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

constexpr double kExact = 1e-9;        // closed forms, a few hundred double operations
constexpr double kEvoAgrees = 1e-6;    // metres or degrees
constexpr double kRoundingDeg = 1e-5;  // the angle of a quaternion near identity

constexpr const char* kTruthTum = R"(
100.0 0.000000 0.000000 0.150000 0.000000 0.000000 0.000000 1.000000
100.1 0.450000 0.677571 0.093241 0.012167 0.024334 0.121670 0.992198
100.2 0.900000 1.118447 -0.034080 0.024144 0.048288 0.241442 0.968912
100.3 1.350000 1.168617 -0.135611 0.035745 0.071489 0.357445 0.930508
100.4 1.800000 0.810556 -0.134514 0.046787 0.093574 0.467871 0.877583
100.5 2.250000 0.169344 -0.031619 0.057100 0.114199 0.570996 0.810963
100.6 2.700000 -0.531025 0.095204 0.066521 0.133042 0.665211 0.731689
100.7 3.150000 -1.045891 0.149979 0.074905 0.149809 0.749046 0.640997
100.8 3.600000 -1.195398 0.091253 0.082119 0.164238 0.821192 0.540302
100.9 4.050000 -0.927317 -0.036532 0.088052 0.176105 0.880523 0.431177
101.0 4.500000 -0.335299 -0.136670 0.092611 0.185223 0.926114 0.315322
101.1 4.950000 0.373850 -0.133379 0.095725 0.191451 0.957254 0.194548)";

constexpr const char* kEstimateTum = R"(
100.0 3.991965 -2.017650 0.640729 0.075746 -0.038295 0.379614 0.921243
100.1 3.878443 -1.208564 0.709843 0.069002 -0.028125 0.489501 0.868813
100.2 3.833550 -0.566127 0.668164 0.062312 0.011896 0.604233 0.794278
100.3 4.154693 -0.255116 0.671607 0.062470 0.016619 0.693533 0.717519
100.4 4.701520 -0.151375 0.642454 0.059791 0.027696 0.769006 0.635836
100.5 5.457649 -0.336017 0.798099 0.048911 0.052077 0.845054 0.529887
100.6 6.257819 -0.543800 0.915548 0.046175 0.073215 0.902690 0.421495
100.7 6.994226 -0.506274 0.908832 0.026282 0.087982 0.947221 0.307151
100.8 7.376317 -0.346930 0.961591 0.022521 0.098609 0.977283 0.186247
100.9 7.510559 0.133409 0.866158 0.018445 0.108390 0.992257 0.057778
101.0 7.481620 0.886823 0.885182 0.006309 0.123823 0.990492 -0.059616
101.1 7.240550 1.700163 1.085388 -0.006986 0.133250 0.973825 -0.184014)";

Trajectory ParseTum(const std::string& text) {
  std::istringstream in(text);
  Trajectory trajectory;
  double stamp, x, y, z, qx, qy, qz, qw;
  while (in >> stamp >> x >> y >> z >> qx >> qy >> qz >> qw) {
    trajectory.push_back(
        {stamp, SE3(Eigen::Quaterniond(qw, qx, qy, qz), Eigen::Vector3d(x, y, z))});
  }
  return trajectory;
}

void ExpectStatistics(
    const ErrorStatistics& actual, double rmse, double mean, double median, double max) {
  EXPECT_NEAR(actual.rmse, rmse, kEvoAgrees);
  EXPECT_NEAR(actual.mean, mean, kEvoAgrees);
  EXPECT_NEAR(actual.median, median, kEvoAgrees);
  EXPECT_NEAR(actual.max, max, kEvoAgrees);
}

SE3 At(double x, double y, double z, double yaw_rad = 0.0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())),
          Eigen::Vector3d(x, y, z)};
}

// One pose per second and metre.
Trajectory Line(int poses) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) trajectory.push_back({double(i), At(i, 0.0, 0.0)});
  return trajectory;
}

Trajectory Moved(const SE3& T_new_old, Trajectory trajectory) {
  for (TimedPose& pose : trajectory) pose.T_world_sensor = T_new_old * pose.T_world_sensor;
  return trajectory;
}

Trajectory RandomWalk(int poses, std::uint64_t seed) {
  Rng rng(seed);
  Trajectory trajectory;
  SE3 pose;
  for (int i = 0; i < poses; ++i) {
    trajectory.push_back({0.1 * i, pose});
    Vector6d step;
    for (int k = 0; k < 6; ++k) step(k) = 0.1 * rng.Normal();
    step(3) += 0.5;
    pose = pose * SE3::Exp(step);
  }
  return trajectory;
}

// Numbers of evo 1.38.1 for the two texts above, saved with --save_results:
//   evo_ape tum truth.tum estimate.tum -r trans_part|angle_deg --align|--align_origin
TEST(TrajectoryError, AbsoluteErrorsAgreeWithEvo) {
  TrajectoryErrorOptions options;
  const TrajectoryError rigid =
      EvaluateTrajectory(ParseTum(kEstimateTum), ParseTum(kTruthTum), options);
  EXPECT_EQ(rigid.matched, 12u);
  ExpectStatistics(rigid.ate_translation_m,
                   0.04592375491727626,
                   0.042699665804974744,
                   0.03983940806122535,
                   0.08444548913692665);
  ExpectStatistics(rigid.ate_rotation_deg,
                   1.0708324933061237,
                   0.9077829926297217,
                   0.6511668957607784,
                   2.4574652813354176);

  options.alignment = Alignment::kFirstPose;
  const TrajectoryError first =
      EvaluateTrajectory(ParseTum(kEstimateTum), ParseTum(kTruthTum), options);
  ExpectStatistics(first.ate_translation_m,
                   0.049600772097981694,
                   0.046379555350410044,
                   0.04814557008938902,
                   0.06975387438412152);
  ExpectStatistics(first.ate_rotation_deg,
                   0.9011128892808071,
                   0.6797667862315498,
                   0.7050407099256317,
                   2.151041952601242);
}

// evo_rpe tum truth.tum estimate.tum -r trans_part|angle_deg -d 1 -u f, and
// evo_rpe tum truth.tum estimate.tum -r trans_part|angle_deg -d 1 -u m --pairs_from_reference
TEST(TrajectoryError, RelativeErrorsAgreeWithEvo) {
  const TrajectoryError error = EvaluateTrajectory(ParseTum(kEstimateTum), ParseTum(kTruthTum));
  EXPECT_EQ(error.rpe_by_pose.pairs, 11);
  ExpectStatistics(error.rpe_by_pose.translation_m,
                   0.07831258339264052,
                   0.07387119321767842,
                   0.07097911416672405,
                   0.12191429288563278);
  ExpectStatistics(error.rpe_by_pose.rotation_deg,
                   1.4129841618526897,
                   1.261185034202695,
                   1.0150510956966892,
                   2.873829792505476);
  EXPECT_EQ(error.rpe_by_distance.pairs, 5);
  ExpectStatistics(error.rpe_by_distance.translation_m,
                   0.06632963135862927,
                   0.06099398885916328,
                   0.045767170759047876,
                   0.10051958019699007);
  ExpectStatistics(error.rpe_by_distance.rotation_deg,
                   1.9460288565642843,
                   1.6587971293167942,
                   1.5602071205092867,
                   3.3145909073201083);
}

TEST(TrajectoryError, KnownOffsetsGiveClosedFormsWithoutAlignment) {
  Trajectory estimate = Line(4);
  estimate[1].T_world_sensor = At(1.0, 3.0, 4.0);                          // 5 m
  estimate[2].T_world_sensor = At(2.0, 0.0, 1.0, std::numbers::pi / 2.0);  // 1 m, 90 deg
  TrajectoryErrorOptions options;
  options.alignment = Alignment::kNone;
  const TrajectoryError error = EvaluateTrajectory(estimate, Line(4), options);
  EXPECT_NEAR(error.ate_translation_m.rmse, std::sqrt(26.0 / 4.0), kExact);
  EXPECT_NEAR(error.ate_translation_m.mean, 1.5, kExact);
  EXPECT_NEAR(error.ate_translation_m.median, 0.5, kExact);
  EXPECT_NEAR(error.ate_translation_m.max, 5.0, kExact);
  EXPECT_NEAR(error.ate_rotation_deg.rmse, 45.0, kExact);
  EXPECT_NEAR(error.truth_length_m, 3.0, kExact);
  EXPECT_NEAR(error.estimate_length_m, std::sqrt(26.0) + std::sqrt(19.0) + std::sqrt(2.0), kExact);
}

TEST(TrajectoryError, ScaleErrorBecomesDriftInPercent) {
  Trajectory estimate = Line(151);
  for (TimedPose& pose : estimate) {
    pose.T_world_sensor = At(1.02 * pose.T_world_sensor.Translation().x(), 0.0, 0.0);
  }
  TrajectoryErrorOptions options;
  options.alignment = Alignment::kFirstPose;
  const TrajectoryError error = EvaluateTrajectory(estimate, Line(151), options);
  ASSERT_EQ(error.kitti_drift.by_length.size(), 1u);
  // The end is the first pose beyond 100 m, which is 101 m on; starts are 0, 10, ..., 40.
  EXPECT_EQ(error.kitti_drift.by_length[0].length_m, 100.0);
  EXPECT_EQ(error.kitti_drift.by_length[0].segments, 5);
  EXPECT_NEAR(error.kitti_drift.overall.translation_percent, 2.0 * 101.0 / 100.0, kExact);
  EXPECT_NEAR(error.kitti_drift.overall.rotation_deg_per_m, 0.0, kRoundingDeg);
  ASSERT_EQ(error.short_drift.by_length.size(), 3u);
  EXPECT_NEAR(error.short_drift.by_length[0].translation_percent, 2.0 * 11.0 / 10.0, kExact);
  EXPECT_NEAR(error.rpe_by_distance.translation_m.rmse, 0.02, kExact);
  EXPECT_EQ(error.rpe_by_distance.pairs, 150);
}

TEST(TrajectoryError, ShortPathHasNoKittiSegments) {
  const TrajectoryError error = EvaluateTrajectory(Line(40), Line(40));
  EXPECT_EQ(error.kitti_drift.overall.segments, 0);
  EXPECT_EQ(error.short_drift.by_length.size(), 2u);
}

TEST(TrajectoryError, DoesNotDependOnTheFramesOfEitherTrajectory) {
  const Trajectory truth = RandomWalk(200, 1);
  Trajectory estimate = truth;
  Rng rng(2);
  for (TimedPose& pose : estimate) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) noise(k) = 0.02 * rng.Normal();
    pose.T_world_sensor = pose.T_world_sensor * SE3::Exp(noise);
  }
  Vector6d far;
  far << 0.4, -1.0, 2.0, 300.0, -200.0, 50.0;
  const TrajectoryError near_error = EvaluateTrajectory(estimate, truth);
  const TrajectoryError far_error =
      EvaluateTrajectory(Moved(SE3::Exp(far), estimate), Moved(SE3::Exp(-0.5 * far), truth));
  EXPECT_GT(near_error.ate_translation_m.rmse, 0.02);
  EXPECT_NEAR(far_error.ate_translation_m.rmse, near_error.ate_translation_m.rmse, kExact);
  EXPECT_NEAR(far_error.ate_rotation_deg.rmse, near_error.ate_rotation_deg.rmse, kRoundingDeg);
  EXPECT_NEAR(far_error.rpe_by_distance.translation_m.rmse,
              near_error.rpe_by_distance.translation_m.rmse,
              kExact);
  EXPECT_NEAR(far_error.short_drift.overall.translation_percent,
              near_error.short_drift.overall.translation_percent,
              kExact);
}

TEST(TrajectoryError, TruthIsInterpolatedAndItsGapsAreCounted) {
  const Trajectory truth = {{0.0, At(0.0, 0.0, 0.0)},
                            {0.4, At(0.4, 0.0, 0.0)},
                            {1.4, At(1.4, 0.0, 0.0)},
                            {1.8, At(1.8, 0.0, 0.0)}};
  const Trajectory estimate = {{-0.1, At(-0.1, 0.0, 0.0)},  // before the truth
                               {0.1, At(0.1, 0.0, 0.0)},
                               {0.9, At(0.9, 0.0, 0.0)},  // in a gap of 1 s
                               {1.5, At(1.5, 0.0, 0.0)},
                               {2.0, At(2.0, 0.0, 0.0)}};  // after the truth
  TrajectoryErrorOptions options;
  options.alignment = Alignment::kNone;
  const TrajectoryError error = EvaluateTrajectory(estimate, truth, options);
  EXPECT_EQ(error.matched, 2u);
  EXPECT_EQ(error.without_truth, 3u);
  EXPECT_NEAR(error.ate_translation_m.max, 0.0, kExact);
  options.max_gap_s = 1.1;
  EXPECT_EQ(EvaluateTrajectory(estimate, truth, options).matched, 3u);
}

TEST(TrajectoryError, NothingToCompareGivesZeros) {
  for (const TrajectoryError& error :
       {EvaluateTrajectory({}, Line(3)), EvaluateTrajectory(Line(3), {})}) {
    EXPECT_EQ(error.matched, 0u);
    EXPECT_EQ(error.ate_translation_m.rmse, 0.0);
    EXPECT_EQ(error.rpe_by_pose.pairs, 0);
    EXPECT_EQ(error.truth_length_m, 0.0);
  }
}

TEST(TrajectoryError, SinglePoseIsAlignedWithItsOrientation) {
  const Trajectory truth = {{0.0, At(1.0, 2.0, 3.0, 0.5)}};
  const TrajectoryError error = EvaluateTrajectory({{0.0, At(-7.0, 0.0, 1.0, -2.0)}}, truth);
  EXPECT_EQ(error.matched, 1u);
  EXPECT_NEAR(error.ate_translation_m.max, 0.0, kExact);
  EXPECT_NEAR(error.ate_rotation_deg.max, 0.0, kRoundingDeg);
  EXPECT_EQ(error.rpe_by_pose.pairs, 0);
}

TEST(TrajectoryError, StraightPathIsAlignedWithItsOrientations) {
  Vector6d offset;
  offset << 1.0, -0.4, 2.0, 10.0, 20.0, -5.0;
  const TrajectoryError error = EvaluateTrajectory(Moved(SE3::Exp(offset), Line(50)), Line(50));
  EXPECT_NEAR(error.ate_translation_m.max, 0.0, 1e-6);
  EXPECT_NEAR(error.ate_rotation_deg.max, 0.0, 1e-4);
}

TEST(TrajectoryError, PosesThatAreNotFiniteAreCountedAndIgnored) {
  Trajectory estimate = Line(5);
  estimate[2].T_world_sensor = At(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0);
  const TrajectoryError error = EvaluateTrajectory(estimate, Line(5));
  EXPECT_EQ(error.not_finite, 1u);
  EXPECT_EQ(error.matched, 4u);
  EXPECT_NEAR(error.ate_translation_m.max, 0.0, 1e-6);
}

double SquaredDistance(const SE3& T_target_source,
                       const std::vector<SE3>& source,
                       const std::vector<SE3>& target) {
  double sum = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    sum += (T_target_source * source[i].Translation() - target[i].Translation()).squaredNorm();
  }
  return sum;
}

TEST(AlignRigid, FindsTheBestRotationEvenWhereAReflectionWouldFitExactly) {
  const std::vector<SE3> source = {
      At(1.0, 0.0, 0.0), At(0.0, 2.0, 0.0), At(0.0, 0.0, 3.0), At(-1.0, -1.0, 0.0)};
  std::vector<SE3> target;
  for (const SE3& pose : source) {
    const Eigen::Vector3d p = pose.Translation();
    target.push_back(At(-p.x(), p.y(), p.z()));
  }
  const SE3 best = AlignRigid(source, target);
  const double least = SquaredDistance(best, source, target);
  Rng rng(3);
  for (int i = 0; i < 500; ++i) {
    Vector6d change;
    for (int k = 0; k < 6; ++k) change(k) = rng.Uniform(0.01, 1.0) * rng.Normal();
    EXPECT_GT(SquaredDistance(best * SE3::Exp(change), source, target), least);
  }
}

}  // namespace
}  // namespace covsplat
