// Odometry in a simulated room: what estimating the motion within a scan is worth.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kNoise = 0.02;
constexpr int kMapScans = 20;
constexpr int kScans = 80;

double StampOf(int scan) { return 0.05 + kScanPeriod * scan; }

// Surfels of truly deskewed scans along the walk, thinned to one per 0.3 m.
RegistrationTarget MapOfTheRoom(ThreadPool& pool) {
  std::vector<TargetSurfel> all;
  const RayScene room = Room();
  const SensorModel sensor = SimulatedSensor();
  for (int k = 0; k < kMapScans; ++k) {
    const double stamp = 1.05 * k;
    const Scan scan =
        Simulate(room, sensor, HandheldWalk, stamp, kNoise, 1000u + static_cast<std::uint64_t>(k));
    AppendSurfels(
        PreprocessStill(TrulyDeskewed(scan, HandheldWalk, stamp), pool), HandheldWalk(stamp), all);
  }
  std::vector<TargetSurfel> thinned;
  VoxelHash taken;
  for (const TargetSurfel& surfel : all) {
    const int next = static_cast<int>(thinned.size());
    if (taken.FindOrInsert(CellOf(surfel.mean / 0.2f), next) == next) thinned.push_back(surfel);
  }
  return RegistrationTarget(thinned, Eigen::Vector3d::Zero(), 1);
}

struct OdometryResult {
  double ate_m = 0.0;
  double rotation_rad = 0.0;
  double iterations = 0.0;
};

enum class Mode { kRaw, kPredicted, kVelocity, kAcceleration, kTruth };

class SimulatedOdometry : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    pool_ = new ThreadPool(2);
    target_ = new RegistrationTarget(MapOfTheRoom(*pool_));
    const RayScene room = Room();
    const SensorModel sensor = SimulatedSensor();
    scans_ = new std::vector<Scan>;
    for (int k = 0; k < kScans; ++k) {
      scans_->push_back(
          Simulate(room, sensor, HandheldWalk, StampOf(k), kNoise, static_cast<std::uint64_t>(k)));
    }
  }
  static void TearDownTestSuite() {
    delete target_;
    delete scans_;
    delete pool_;
  }

  static OdometryResult Run(Mode mode) {
    GicpConfig config;
    config.motion_model = mode == Mode::kVelocity       ? MotionModel::kVelocity
                          : mode == Mode::kAcceleration ? MotionModel::kAcceleration
                                                        : MotionModel::kRigid;
    const bool still = mode == Mode::kRaw || mode == Mode::kTruth;
    OdometryResult result;
    MotionPrediction prediction = At(HandheldWalk(StampOf(0)));
    for (int k = 0; k < kScans; ++k) {
      const double stamp = StampOf(k);
      const Scan scan =
          mode == Mode::kTruth
              ? TrulyDeskewed((*scans_)[static_cast<std::size_t>(k)], HandheldWalk, stamp)
              : (*scans_)[static_cast<std::size_t>(k)];
      DeskewConfig deskew;
      if (still) deskew.time_source = TimeSource::kNone;
      const ScanTiming timing = TimeScan(scan, deskew);
      const SourceCloud source =
          Preprocess(scan, timing, prediction.motion, PreprocessConfig{}, *pool_);
      const AlignResult aligned = Align(source, *target_, prediction, config, *pool_);
      const SE3 truth = HandheldWalk(stamp);
      result.ate_m += std::pow(TranslationError(aligned.motion.T_map_sensor, truth), 2);
      result.rotation_rad += std::pow(RotationError(aligned.motion.T_map_sensor, truth), 2);
      result.iterations += aligned.iterations;
      prediction = Predict(mode, aligned, k == 0);
    }
    result.ate_m = std::sqrt(result.ate_m / kScans);
    result.rotation_rad = std::sqrt(result.rotation_rad / kScans);
    result.iterations /= kScans;
    return result;
  }

  static MotionPrediction Predict(Mode mode, const AlignResult& aligned, bool first) {
    const ScanMotion& motion = aligned.motion;
    if (mode == Mode::kVelocity || mode == Mode::kAcceleration) {
      MotionPrediction next =
          PredictMotion(motion, kScanPeriod, kScanPeriod, kScanPeriod, aligned.covariance);
      if (first) next.horizon_s = 1.0;
      return next;
    }
    // Constant velocity from the last two poses.
    static SE3 before;
    const SE3 now = motion.T_map_sensor;
    const SE3 step = first ? SE3() : before.Inverse() * now;
    before = now;
    MotionPrediction next = At(now * step);
    if (mode == Mode::kPredicted) next.motion.twist = step.Log();
    return next;
  }

  static inline ThreadPool* pool_ = nullptr;
  static inline RegistrationTarget* target_ = nullptr;
  static inline std::vector<Scan>* scans_ = nullptr;
};

TEST_F(SimulatedOdometry, EstimatingTheMotionWithinAScanComesNearTheTruth) {
  const auto run = [](const char* name, Mode mode) {
    const OdometryResult result = Run(mode);
    std::printf("%-24s ATE %6.2f mm, rotation %5.2f mrad, %.1f iterations\n",
                name,
                1e3 * result.ate_m,
                1e3 * result.rotation_rad,
                result.iterations);
    return result;
  };
  std::printf("map of %zu surfels\n", target_->Size());
  const OdometryResult raw = run("raw", Mode::kRaw);
  const OdometryResult predicted = run("constant velocity", Mode::kPredicted);
  const OdometryResult velocity = run("estimated velocity", Mode::kVelocity);
  const OdometryResult acceleration = run("estimated acceleration", Mode::kAcceleration);
  const OdometryResult truth = run("truly deskewed", Mode::kTruth);
  EXPECT_LT(truth.ate_m, 0.005);
  EXPECT_LT(acceleration.ate_m, 3.0 * truth.ate_m);
  EXPECT_LT(acceleration.ate_m, 0.5 * velocity.ate_m);
  EXPECT_LT(velocity.ate_m, 0.5 * predicted.ate_m);
  EXPECT_LT(velocity.ate_m, 0.5 * raw.ate_m);
}

}  // namespace
}  // namespace covsplat::test
