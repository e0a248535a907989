// Registration of real scans; skipped where the recordings are not installed.
#include "tests/support/recorded_scans.hpp"

#include <cstdio>
#include <deque>
#include <fstream>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

RegistrationTarget TargetFrom(const SourceCloud& cloud, const SE3& T_map_sensor) {
  std::vector<TargetSurfel> surfels;
  AppendSurfels(cloud, T_map_sensor, surfels);
  return RegistrationTarget(surfels, Eigen::Vector3d::Zero(), 1);
}

TEST(RecordedPair, IsAlignedAsItsReferenceSays) {
  const auto folder = DataFolder() / "pair_small";
  const Scan source_scan = ReadFloatPly(folder / "source.ply");
  const Scan target_scan = ReadFloatPly(folder / "target.ply");
  if (source_scan.points.empty() || target_scan.points.empty()) {
    GTEST_SKIP() << "no pair_small in " << DataFolder() << "; set COVSPLAT_DATA";
  }
  Eigen::Matrix4d reference;
  std::ifstream file(folder / "T_target_source.txt");
  for (int k = 0; k < 16; ++k) file >> reference(k / 4, k % 4);

  ThreadPool pool(2);
  PreprocessConfig preprocess;
  preprocess.downsample_voxel_m = 0.25;
  const auto prepare = [&](const Scan& scan) {
    return Preprocess(scan, ScanTiming{}, ScanMotion{}, preprocess, pool);
  };
  const RegistrationTarget target = TargetFrom(prepare(target_scan), SE3());
  const AlignResult result = Align(prepare(source_scan), target, At(SE3()), GicpConfig{}, pool);
  const SE3 truth = SE3::FromMatrix(reference);
  std::printf("pair: %.1f mm, %.2f mrad from the reference, rms %.1f mm, %d iterations\n",
              1e3 * TranslationError(result.motion.T_map_sensor, truth),
              1e3 * RotationError(result.motion.T_map_sensor, truth),
              1e3 * result.rms_residual_m,
              result.iterations);
  EXPECT_TRUE(result.converged);
  EXPECT_LT(TranslationError(result.motion.T_map_sensor, truth), 0.03);
  EXPECT_LT(RotationError(result.motion.T_map_sensor, truth), 4e-3);
}

constexpr double kPeriod = 0.10327;

Scan DriveScan(int number) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.bin", number);
  return ReadVelodyneBin(DataFolder() / "kitti_raw_0005/velodyne" / name);
}

PreprocessConfig DrivePreprocess() {
  PreprocessConfig preprocess;
  preprocess.min_range_m = 2.5;
  preprocess.max_range_m = 80.0;
  return preprocess;
}

// The step from the first scan to the second, both taken as rigid: the first scan's twist.
Vector6d FirstTwist(ThreadPool& pool) {
  const auto prepare = [&](int k) {
    return Preprocess(DriveScan(k), ScanTiming{}, ScanMotion{}, DrivePreprocess(), pool);
  };
  const RegistrationTarget target = TargetFrom(prepare(0), SE3());
  return Align(prepare(1), target, At(SE3()), {}, pool).motion.T_map_sensor.Log();
}

struct ChainResult {
  double residual_m = 0.0;   // mean over the scans
  double end_error_m = 0.0;  // to the reference
  double gap_m = 0.0;        // mean of |twist - step from the scan before|, translation
};

// Each scan to the surfels of the last few, all deskewed by what was estimated.
ChainResult Chain(int scans, const DeskewConfig& deskew, MotionModel model) {
  constexpr std::size_t kWindow = 8;
  ThreadPool pool(2);
  GicpConfig config;
  config.motion_model = model;
  ChainResult chain;
  MotionPrediction prediction;
  std::deque<std::vector<TargetSurfel>> window;
  ScanMotion motion;
  motion.twist = FirstTwist(pool);
  prediction.motion = motion;
  for (int k = 0; k < scans; ++k) {
    const Scan scan = DriveScan(k);
    const ScanTiming timing = TimeScan(scan, deskew);
    SourceCloud source = Preprocess(scan, timing, prediction.motion, DrivePreprocess(), pool);
    Matrix18d covariance = Matrix18d::Zero();
    if (k > 0) {
      std::vector<TargetSurfel> map;
      for (const auto& surfels : window) map.insert(map.end(), surfels.begin(), surfels.end());
      const RegistrationTarget target(map, Eigen::Vector3d::Zero(), 1);
      const AlignResult result = Align(source, target, prediction, config, pool);
      const Vector6d step = (motion.T_map_sensor.Inverse() * result.motion.T_map_sensor).Log();
      motion = result.motion;
      covariance = result.covariance;
      if (model == MotionModel::kRigid) motion.twist = step;
      chain.residual_m += result.rms_residual_m / (scans - 1);
      chain.gap_m += (motion.twist - step).tail<3>().norm() / (scans - 1);
    }
    prediction = PredictMotion(motion, kPeriod, kPeriod, kPeriod, covariance);
    source.points =
        Deskew(source.points, source.phase, timing.phase.empty() ? ScanMotion{} : motion);
    AppendSurfels(source, motion.T_map_sensor, window.emplace_back());
    if (window.size() > kWindow) window.pop_front();
  }
  std::ifstream poses(DataFolder() / "kitti_raw_0005/poses_reference.txt");
  Eigen::Matrix4d reference = Eigen::Matrix4d::Identity();
  for (int k = 0; k < scans * 12; ++k) poses >> reference(k % 12 / 4, k % 4);
  chain.end_error_m = TranslationError(motion.T_map_sensor, SE3::FromMatrix(reference));
  return chain;
}

TEST(RecordedDrive, FitsBestWithTheTimesOfItsAzimuths) {
  if (ReadVelodyneBin(DataFolder() / "kitti_raw_0005/velodyne/000000.bin").points.empty()) {
    GTEST_SKIP() << "no kitti_raw_0005 in " << DataFolder() << "; set COVSPLAT_DATA";
  }
  // A map deskewed wrongly fits scans deskewed as wrongly, so residuals do not tell the two
  // directions apart; whether the motion goes on from scan to scan does, and where it ends.
  constexpr int kScans = 80;
  DeskewConfig none{.time_source = TimeSource::kNone};
  DeskewConfig azimuth{.time_source = TimeSource::kAzimuth, .scan_period_s = 0.10327};
  DeskewConfig reverse = azimuth;
  reverse.azimuth_clockwise = false;
  const auto run = [](const char* name, const DeskewConfig& deskew, MotionModel model) {
    const ChainResult chain = Chain(kScans, deskew, model);
    std::printf("%-24s residual %.1f mm, end %.0f mm from the reference, twist off by %.0f mm\n",
                name,
                1e3 * chain.residual_m,
                1e3 * chain.end_error_m,
                1e3 * chain.gap_m);
    return chain;
  };
  const ChainResult still = run("no deskew", none, MotionModel::kRigid);
  const ChainResult wrong = run("reverse, acceleration", reverse, MotionModel::kAcceleration);
  const ChainResult right = run("azimuth, acceleration", azimuth, MotionModel::kAcceleration);
  EXPECT_LT(right.residual_m, still.residual_m);
  EXPECT_LT(right.gap_m, 0.25 * wrong.gap_m);
  EXPECT_LT(right.end_error_m, 0.5 * wrong.end_error_m);
  EXPECT_LT(right.end_error_m, 0.1);
}

}  // namespace
}  // namespace covsplat::test
