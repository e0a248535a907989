#include "covsplat/sim/simulation.hpp"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace covsplat {
namespace {

SimulationConfig Small() {
  SimulationConfig config;
  config.lidar.rows = 16;
  config.lidar.columns = 128;
  return config;
}

TEST(Simulation, TruthIsExactAtEveryStampAndCoversEveryPoint) {
  SimulationConfig config = Small();
  config.max_scans = 40;
  const Simulation simulation = Simulation::Create(config).value();
  ASSERT_EQ(simulation.ScanCount(), 40);
  const Trajectory truth = simulation.Truth(200.0);
  for (std::size_t i = 1; i < truth.size(); ++i) {
    EXPECT_GT(truth[i].stamp_s, truth[i - 1].stamp_s);
    EXPECT_LT(truth[i].stamp_s, truth[i - 1].stamp_s + 0.005 + 1e-9);
  }
  ThreadPool pool(2);
  for (int i = 0; i < simulation.ScanCount(); ++i) {
    const Scan scan = simulation.MakeScan(i, pool);
    EXPECT_EQ(scan.index, i);
    const auto pose = PoseAt(truth, scan.stamp_s, 0.01);
    ASSERT_TRUE(pose);
    EXPECT_EQ((simulation.PoseOf(i).Inverse() * *pose).Log().norm(), 0.0);
    EXPECT_LT(truth.front().stamp_s,
              scan.stamp_s + static_cast<double>(scan.time_offset_s.front()));
    EXPECT_GT(truth.back().stamp_s, scan.stamp_s + static_cast<double>(scan.time_offset_s.back()));
  }
}

TEST(Simulation, WithoutALimitItLastsTheWholeWalk) {
  const Simulation simulation = Simulation::Create(Small()).value();
  EXPECT_GT(simulation.ScanCount(), 500);
  const SE3 there_and_back =
      simulation.PoseOf(0).Inverse() * simulation.PoseOf(simulation.ScanCount() - 1);
  EXPECT_LT(there_and_back.Translation().norm(), 0.01);
}

TEST(Simulation, BadConfigurationsAreErrors) {
  SimulationConfig config = Small();
  config.world = "atlantis";
  EXPECT_FALSE(Simulation::Create(config));
  config = Small();
  config.lidar.columns = 130;
  EXPECT_FALSE(Simulation::Create(config));
  config = Small();
  config.lidar.elevation_low_deg = 50.0;
  EXPECT_FALSE(Simulation::Create(config));
}

// Information of point-to-plane registration per point, lever arms in units of 10 m: small in a
// direction in which the scan could slide over the world unnoticed.
double WeakestDirection(const Simulation& simulation, int scan_index) {
  const SE3 T_world_sensor = simulation.PoseOf(scan_index);
  const SensorModel sensor = simulation.Sensor();
  Matrix6d information = Matrix6d::Zero();
  int hits = 0;
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const Eigen::Vector3f ray =
          (T_world_sensor.Rotation() * sensor.RayOf(row, column).cast<double>().eval())
              .cast<float>();
      const auto hit =
          simulation.World().Cast(T_world_sensor.Translation().cast<float>(), ray, 50.0f);
      if (!hit) continue;
      const Eigen::Vector3d normal = hit->normal.cast<double>();
      Vector6d row_of_jacobian;
      row_of_jacobian << 0.1 * (hit->range_m * ray.cast<double>()).cross(normal), normal;
      information += row_of_jacobian * row_of_jacobian.transpose();
      ++hits;
    }
  }
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(information / hits).eigenvalues()(0);
}

TEST(Simulation, TheCourtyardHoldsTheSensorInAllDirectionsEverywhere) {
  const Simulation simulation = Simulation::Create(Small()).value();
  for (int scan = 0; scan < simulation.ScanCount(); scan += 10) {
    EXPECT_GT(WeakestDirection(simulation, scan), 0.01) << "scan " << scan;
  }
}

}  // namespace
}  // namespace covsplat
