#include "covsplat/sim/simulation.hpp"

#include <string>
#include <utility>

#include "tests/support/temporary_folder.hpp"
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace covsplat {
namespace {

SimulationConfig Small() {
  SimulationConfig config;
  config.lidar.rows = 16;
  config.lidar.columns = 128;
  config.lidar.mixed_pixel_probability = 0.0;
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
          simulation.StaticWorld().Cast(T_world_sensor.Translation().cast<float>(), ray, 50.0f);
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

TEST(Simulation, TheTunnelLetsTheSensorSlideBetweenItsPortals) {
  SimulationConfig config = Small();
  config.world = "tunnel";
  const Simulation simulation = Simulation::Create(config).value();
  EXPECT_GT(WeakestDirection(simulation, 0), 0.005) << "outside";
  EXPECT_LT(WeakestDirection(simulation, simulation.ScanCount() / 2), 2e-4) << "inside";
}

TEST(Simulation, ScansDependOnSeedAndNumberAlone) {
  SimulationConfig config = Small();
  config.world = "street";
  config.lidar.mixed_pixel_probability = 0.5;
  const Simulation first = Simulation::Create(config).value();
  const Simulation again = Simulation::Create(config).value();
  ThreadPool one(1);
  ThreadPool three(3);
  const Scan earlier = first.MakeScan(20, one);
  const Scan later = again.MakeScan(200, three);
  EXPECT_EQ(again.MakeScan(20, three).points, earlier.points);
  EXPECT_EQ(again.MakeScan(20, three).label, earlier.label);
  EXPECT_EQ(first.MakeScan(200, one).points, later.points);
}

// A room of 6 x 8 x 3 m in millimetres, y up, in the format that everybody writes.
std::string RoomObj() {
  std::string text;
  for (const int y : {0, 3000}) {
    for (const auto& [x, z] : {std::pair{0, 0}, {6000, 0}, {6000, 8000}, {0, 8000}}) {
      text += fmt::format("v {} {} {}\n", x, y, z);
    }
  }
  return text + "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
}

class UserMesh : public testing::Test {
 protected:
  SimulationConfig ConfigFor(const std::string& name, const std::string& text) {
    SimulationConfig config = Small();
    config.world = folder_.Put(name, text).string();
    config.mesh.up = UpAxis::kY;
    config.mesh.scale = 0.001;
    config.route.points_m = {1.0, -1.0, 0.0, 4.0, -6.0, 0.0};
    config.lidar.range_noise_m = 0.0;
    return config;
  }
  TemporaryFolder folder_;
};

TEST_F(UserMesh, IsScaledAndTurnedUpright) {
  const Simulation simulation = Simulation::Create(ConfigFor("room.obj", RoomObj())).value();
  EXPECT_TRUE(simulation.Warnings().empty());
  EXPECT_EQ(simulation.StaticWorld().Mesh().triangles.size(), 12u);
  ThreadPool pool(1);
  const Scan scan = simulation.MakeScan(0, pool);
  const SE3 T_world_sensor = simulation.PoseOf(0);
  EXPECT_GT(scan.points.size(), 1500u);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = simulation.SensorMotion().PoseAt(
                                      scan.stamp_s + static_cast<double>(scan.time_offset_s[i])) *
                                  scan.points[i].cast<double>().eval();
    EXPECT_TRUE(simulation.StaticWorld().DistanceTo(point.cast<float>(), 1e-3f));
  }
  EXPECT_NEAR(T_world_sensor.Translation().z(), 1.7, 0.05);
}

TEST_F(UserMesh, ASizeThatIsAThousandfoldOffIsWarnedOf) {
  SimulationConfig config = ConfigFor("room.obj", RoomObj());
  config.mesh.scale = 1.0;
  const Simulation large = Simulation::Create(config).value();
  ASSERT_FALSE(large.Warnings().empty());
  EXPECT_NE(large.Warnings().front().find("mesh.scale=0.001"), std::string::npos);
  config.mesh.scale = 1e-6;
  const Simulation small = Simulation::Create(config).value();
  ASSERT_FALSE(small.Warnings().empty());
  EXPECT_NE(small.Warnings().front().find("mesh.scale=1000"), std::string::npos);
}

TEST_F(UserMesh, NonsenseIsAnErrorThatSaysWhatToDo) {
  const auto message = [&](const SimulationConfig& config) {
    const Result<Simulation> simulation = Simulation::Create(config);
    return simulation ? std::string() : simulation.error().message;
  };
  EXPECT_NE(message(ConfigFor("points.obj", "v 0 0 0\nv 1 0 0\n")), "");
  EXPECT_NE(message(ConfigFor("empty.obj", "")), "");
  EXPECT_NE(message(ConfigFor("broken.glb", "glTF?")), "");
  EXPECT_NE(message(ConfigFor("cloud.ply",
                              "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                              "property float y\nproperty float z\nelement face 0\n"
                              "property list uchar int vertex_indices\nend_header\n0 0 0\n"))
                .find("no triangles"),
            std::string::npos);
  SimulationConfig config = ConfigFor("room.obj", RoomObj());
  config.route.points_m.clear();
  EXPECT_NE(message(config).find("--path"), std::string::npos);
  config.route.points_m = {1.0, 2.0, 3.0, 4.0};
  EXPECT_NE(message(config).find("route.points_m"), std::string::npos);
  config.route.file = "/nowhere/poses.txt";
  config.laps = 2;
  EXPECT_NE(message(config).find("--laps"), std::string::npos);
  config.laps = 1;
  EXPECT_NE(message(config).find("/nowhere/poses.txt"), std::string::npos);
  config.route.file = folder_.Put("one.txt", "0 0 0 0 0 0 0 1\n").string();
  EXPECT_NE(message(config).find("two or more"), std::string::npos);
  config.world = "/nowhere/room.obj";
  EXPECT_NE(message(config).find("does not exist"), std::string::npos);
}

TEST_F(UserMesh, CameraPosesBecomeThoseOfASensorThatLooksForward) {
  SimulationConfig config = ConfigFor("room.obj", RoomObj());
  config.route.frame = PathFrame::kCamera;
  // Along the camera's axis, z, one metre a pose: forward, so along x.
  std::string poses;
  for (int i = 0; i < 4; ++i) poses += fmt::format("1 0 0 0 0 1 0 -1.5 0 0 1 {}\n", i);
  config.route.file = folder_.Put("poses.txt", poses).string();
  config.route.rate_hz = 2.0;
  const Motion motion = LoadUserMotion(config.route).value();
  EXPECT_NEAR(motion.Duration(), 1.5, 1e-9);
  const SE3 middle = motion.PoseAt(0.75);
  EXPECT_NEAR(middle.Translation().x(), 1.5, 1e-6);
  EXPECT_NEAR(middle.Translation().z(), 1.5, 1e-6) << "y down becomes z up";
  EXPECT_NEAR((middle.Rotation() * Eigen::Vector3d::UnitX()).x(), 1.0, 1e-9);
}

}  // namespace
}  // namespace covsplat
