#include <cmath>
#include <limits>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

TEST(TimeScan, SpansTheFieldsTimes) {
  Scan scan;
  scan.stamp_s = 100.0;
  scan.points.assign(3, Eigen::Vector3f::UnitX());
  scan.time_offset_s = {0.02f, 0.07f, 0.12f};
  const ScanTiming timing = TimeScan(scan, DeskewConfig{});
  EXPECT_NEAR(timing.mid_stamp_s, 100.07, 1e-6);
  EXPECT_NEAR(timing.duration_s, 0.1, 1e-6);
  ASSERT_EQ(timing.phase.size(), 3u);
  EXPECT_NEAR(timing.phase[0], -0.5f, 1e-6f);
  EXPECT_NEAR(timing.phase[1], 0.0f, 1e-6f);
  EXPECT_NEAR(timing.phase[2], 0.5f, 1e-6f);
}

TEST(TimeScan, CountsTimesThatAreNotFinite) {
  Scan scan;
  scan.points.assign(4, Eigen::Vector3f::UnitX());
  scan.time_offset_s = {0.0f, std::nanf(""), 0.1f, std::numeric_limits<float>::infinity()};
  const ScanTiming timing = TimeScan(scan, DeskewConfig{});
  EXPECT_EQ(timing.invalid, 2u);
  EXPECT_EQ(timing.phase[1], 0.0f);
  EXPECT_EQ(timing.phase[3], 0.0f);
  EXPECT_NEAR(timing.duration_s, 0.1, 1e-6);

  scan.time_offset_s.assign(4, std::nanf(""));
  const ScanTiming none = TimeScan(scan, DeskewConfig{});
  EXPECT_EQ(none.invalid, 4u);
  EXPECT_TRUE(none.phase.empty());
  EXPECT_EQ(none.duration_s, 0.0);
}

TEST(TimeScan, TakesAScanWithoutTimesAsTakenAtOnce) {
  Scan scan;
  scan.stamp_s = 5.0;
  scan.points.assign(2, Eigen::Vector3f::UnitX());
  const ScanTiming timing = TimeScan(scan, DeskewConfig{});
  EXPECT_TRUE(timing.phase.empty());
  EXPECT_EQ(timing.mid_stamp_s, 5.0);
  EXPECT_TRUE(TimeScan(Scan{}, DeskewConfig{}).phase.empty());
}

TEST(TimeScan, ReadsTheAzimuthFromTheRearClockwise) {
  Scan scan;
  scan.stamp_s = 5.0;
  for (const float azimuth : {3.1415f, 1.5708f, 0.0f, -1.5708f, -3.1415f}) {
    scan.points.emplace_back(std::cos(azimuth), std::sin(azimuth), 0.3f);
  }
  scan.points.emplace_back(std::nanf(""), 0.0f, 0.0f);
  DeskewConfig config{.time_source = TimeSource::kAzimuth};
  const ScanTiming timing = TimeScan(scan, config);
  const float expected[] = {-0.5f, -0.25f, 0.0f, 0.25f, 0.5f};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(timing.phase[i], expected[i], 1e-4f);
  EXPECT_EQ(timing.invalid, 1u);
  EXPECT_EQ(timing.phase[5], 0.0f);
  EXPECT_EQ(timing.mid_stamp_s, 5.0);
  EXPECT_EQ(timing.duration_s, 0.1);

  config.azimuth_clockwise = false;
  const ScanTiming reverse = TimeScan(scan, config);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(reverse.phase[i], -expected[i], 1e-4f);
}

TEST(Deskew, UndoesTheTrueMotion) {
  // Within a scan of the walk the third order of the motion is left over.
  const double stamp = 1.0;
  const Scan scan = Simulate(Room(), SimulatedSensor(), HandheldWalk, stamp, 0.0);
  const SE3 mid = HandheldWalk(stamp);
  const Vector6d before = (mid.Inverse() * HandheldWalk(stamp - 0.5 * kScanPeriod)).Log();
  const Vector6d after = (mid.Inverse() * HandheldWalk(stamp + 0.5 * kScanPeriod)).Log();
  const ScanMotion motion{mid, after - before, 4.0 * (after + before)};
  const std::vector<Eigen::Vector3f> deskewed =
      Deskew(scan.points, TimeScan(scan, DeskewConfig{}).phase, motion);
  const Scan truth = TrulyDeskewed(scan, HandheldWalk, stamp);
  float worst = 0.0f;
  for (std::size_t i = 0; i < deskewed.size(); ++i) {
    worst = std::max(worst, (deskewed[i] - truth.points[i]).norm());
  }
  EXPECT_LT(worst, 0.01f);
}

TEST(PoseTable, AgreesWithTheExactPoses) {
  ScanMotion motion;
  motion.twist << 0.3, -0.2, 0.5, 1.5, -0.5, 0.2;
  motion.acceleration << 0.05, 0.1, -0.1, 0.2, 0.1, 0.0;
  const SE3 frame = MakePose(0.3, -0.5, 2.0, 0, 0, 0);
  const PoseTable table(motion, frame.RotationMatrix());
  for (double s = -0.5; s <= 0.5; s += 0.00317) {
    const PoseTable::Pose pose = table.At(static_cast<float>(s));
    const SE3 exact = frame * motion.Within(s);
    EXPECT_LT((pose.rotation.cast<double>() - exact.RotationMatrix()).norm(), 2e-6) << s;
    EXPECT_LT((pose.translation.cast<double>() - exact.Translation()).norm(), 3e-6) << s;
  }
  const PoseTable::Pose last = table.At(0.5f);
  EXPECT_LT((last.translation.cast<double>() - (frame * motion.Within(0.5)).Translation()).norm(),
            1e-6);
}

TEST(PredictMotion, ContinuesAConstantVelocity) {
  ScanMotion motion{MakePose(0.1, 0.2, 0.3, 1, 2, 3), Vector6d::Zero(), Vector6d::Zero()};
  motion.twist << 0.01, 0.02, 0.1, 0.15, 0.0, 0.01;
  const MotionPrediction next = PredictMotion(motion, 0.1, 0.1, 0.1);
  const SE3 expected = motion.T_map_sensor * SE3::Exp(motion.twist);
  EXPECT_LT((expected.Inverse() * next.motion.T_map_sensor).Log().norm(), 1e-12);
  EXPECT_LT((next.motion.twist - motion.twist).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(next.horizon_s, 0.1);
  // A lost scan doubles the gap; a shorter scan shortens the twist.
  const MotionPrediction later = PredictMotion(motion, 0.1, 0.05, 0.2);
  const SE3 expected_later = motion.T_map_sensor * SE3::Exp(2.0 * motion.twist);
  EXPECT_LT((expected_later.Inverse() * later.motion.T_map_sensor).Log().norm(), 1e-12);
  EXPECT_LT((later.motion.twist - 0.5 * motion.twist).norm(), 1e-12);
  EXPECT_GT(later.horizon_s, next.horizon_s);
}

// Against central differences of the prediction itself.
TEST(PredictMotion, CarriesTheCovarianceAlong) {
  ScanMotion motion{MakePose(0.1, 0.2, 0.3, 1, 2, 3), Vector6d::Zero(), Vector6d::Zero()};
  motion.twist << 0.01, 0.02, 0.05, 0.15, 0.0, 0.01;
  using Vector18d = Eigen::Matrix<double, 18, 1>;
  const auto predict = [&](const Vector18d& step) {
    const ScanMotion moved{motion.T_map_sensor * SE3::Exp(step.head<6>()),
                           motion.twist + step.segment<6>(6),
                           motion.acceleration + step.tail<6>()};
    return PredictMotion(moved, 0.1, 0.05, 0.12).motion;
  };
  const SE3 middle = predict(Vector18d::Zero()).T_map_sensor;
  Eigen::Matrix<double, 12, 18> jacobian;
  for (int k = 0; k < 18; ++k) {
    constexpr double kStep = 1e-5;
    const ScanMotion up = predict(kStep * Vector18d::Unit(k));
    const ScanMotion down = predict(-kStep * Vector18d::Unit(k));
    jacobian.col(k) << (middle.Inverse() * up.T_map_sensor).Log() -
                           (middle.Inverse() * down.T_map_sensor).Log(),
        up.twist - down.twist;
    jacobian.col(k) /= 2.0 * kStep;
  }
  const Matrix18d root = Matrix18d::Random();
  const Matrix18d covariance = root * root.transpose();
  const Matrix12d expected = jacobian * covariance * jacobian.transpose();
  const Matrix12d carried = PredictMotion(motion, 0.1, 0.05, 0.12, covariance).covariance;
  // To first order in the motion between the two scans.
  EXPECT_LT((carried - expected).norm(), 0.15 * expected.norm());
  EXPECT_TRUE(PredictMotion(motion, 0.1, 0.05, 0.12).covariance.isZero());
}

TEST(PredictMotion, KeepsThePoseWhenThereAreNoTimes) {
  const ScanMotion motion{MakePose(0.1, 0.2, 0.3, 1, 2, 3), Vector6d::Ones(), Vector6d::Zero()};
  const MotionPrediction next = PredictMotion(motion, 0.0, 0.1, 0.1);
  EXPECT_EQ(next.motion.T_map_sensor.Matrix(), motion.T_map_sensor.Matrix());
  EXPECT_EQ(next.horizon_s, 0.0);
}

}  // namespace
}  // namespace covsplat::test
