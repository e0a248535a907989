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

struct ChainResult {
  double residual_m = 0.0;   ///< mean over the scans
  double end_error_m = 0.0;  ///< to the reference
  double iterations = 0.0;
};

// Each scan to the surfels of the last few, all deskewed by what was estimated.
ChainResult Chain(int scans, const DeskewConfig& deskew, MotionModel model) {
  constexpr double kPeriod = 0.10327;
  constexpr std::size_t kWindow = 8;
  ThreadPool pool(2);
  GicpConfig config;
  config.motion_model = model;
  PreprocessConfig preprocess;
  preprocess.min_range_m = 2.5;
  preprocess.max_range_m = 80.0;
  ChainResult chain;
  MotionPrediction prediction;
  prediction.sigma_scale = 0.0;
  std::deque<std::vector<TargetSurfel>> window;
  ScanMotion motion;
  SE3 before_pose;
  for (int k = 0; k < scans; ++k) {
    char name[32];
    std::snprintf(name, sizeof name, "%06d.bin", k);
    const Scan scan = ReadVelodyneBin(DataFolder() / "kitti_raw_0005/velodyne" / name);
    const ScanTiming timing = TimeScan(scan, deskew);
    SourceCloud source = Preprocess(scan, timing, prediction.motion, preprocess, pool);
    if (k > 0) {
      std::vector<TargetSurfel> map;
      for (const auto& surfels : window) map.insert(map.end(), surfels.begin(), surfels.end());
      const RegistrationTarget target(map, Eigen::Vector3d::Zero(), 1);
      const AlignResult result = Align(source, target, prediction, config, pool);
      motion = result.motion;
      chain.residual_m += result.rms_residual_m / (scans - 1);
      chain.iterations += static_cast<double>(result.iterations) / (scans - 1);
    }
    const double duration = timing.duration_s > 0.0 ? timing.duration_s : kPeriod;
    if (k > 0 && model == MotionModel::kRigid) {
      motion.twist = (before_pose.Inverse() * motion.T_map_sensor).Log() * (duration / kPeriod);
    }
    if (k==8||k==15||k==19) printf("  k %d twist %.4f %.4f %.4f  %.3f %.3f %.3f | step %.4f %.4f %.4f %.3f %.3f %.3f\n",k,motion.twist[0],motion.twist[1],motion.twist[2],motion.twist[3],motion.twist[4],motion.twist[5],(before_pose.Inverse()*motion.T_map_sensor).Log()[0],(before_pose.Inverse()*motion.T_map_sensor).Log()[1],(before_pose.Inverse()*motion.T_map_sensor).Log()[2],(before_pose.Inverse()*motion.T_map_sensor).Log()[3],(before_pose.Inverse()*motion.T_map_sensor).Log()[4],(before_pose.Inverse()*motion.T_map_sensor).Log()[5]);
    before_pose = motion.T_map_sensor;
    prediction = PredictMotion(motion, duration, duration, kPeriod);
    if (k <= 1) prediction.sigma_scale = 20.0;
    source.points = Deskew(source.points, source.phase, motion);
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
  constexpr int kScans = 20;
  DeskewConfig none{.time_source = TimeSource::kNone};
  DeskewConfig azimuth{.time_source = TimeSource::kAzimuth, .scan_period_s = 0.10327};
  DeskewConfig reverse = azimuth;
  reverse.azimuth_clockwise = false;
  const auto run = [](const char* name, const DeskewConfig& deskew, MotionModel model) {
    const ChainResult chain = Chain(kScans, deskew, model);
    std::printf("%-28s residual %.1f mm, end %.0f mm from the reference, %.1f iterations\n",
                name,
                1e3 * chain.residual_m,
                1e3 * chain.end_error_m,
                chain.iterations);
    return chain;
  };
  const ChainResult still = run("no deskew", none, MotionModel::kRigid);
  const ChainResult wrong = run("wrong direction, rigid", reverse, MotionModel::kRigid);
  const ChainResult rigid = run("azimuth, rigid", azimuth, MotionModel::kRigid);
  const ChainResult velocity = run("azimuth, velocity", azimuth, MotionModel::kVelocity);
  const ChainResult full = run("azimuth, acceleration", azimuth, MotionModel::kAcceleration);
  run("wrong direction, velocity", reverse, MotionModel::kVelocity);
  for (const ChainResult& right : {velocity, full}) {
    EXPECT_LT(right.residual_m, still.residual_m);
    EXPECT_LT(right.residual_m, wrong.residual_m);
    EXPECT_LT(right.end_error_m, 0.5);
  }
  EXPECT_LE(full.residual_m, rigid.residual_m * 1.1);
}

}  // namespace
}  // namespace covsplat::test
