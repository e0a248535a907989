#include "covsplat/io/trajectory_file.hpp"

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"
#include "covsplat/io/ground_truth.hpp"

namespace covsplat {
namespace {

Trajectory RandomTrajectory(int size) {
  Rng rng(7);
  Trajectory trajectory;
  for (int i = 0; i < size; ++i) {
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = rng.Uniform(-2.0, 2.0);
    trajectory.push_back({1.7e9 + 0.1 * i, SE3::Exp(xi)});
  }
  return trajectory;
}

double Distance(const SE3& a, const SE3& b) { return (a.Matrix() - b.Matrix()).norm(); }

TEST(TrajectoryFile, TumKeepsEveryDigit) {
  const TemporaryFolder folder;
  const Trajectory trajectory = RandomTrajectory(20);
  ASSERT_TRUE(WriteTum(folder.Path() / "t.txt", trajectory));
  EXPECT_EQ(folder.Get("t.txt").find(" \n"), std::string::npos);
  const auto read = ReadTum(folder.Path() / "t.txt");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_NEAR((*read)[i].stamp_s, trajectory[i].stamp_s, 1e-9);
    EXPECT_LT(Distance((*read)[i].T_world_sensor, trajectory[i].T_world_sensor), 1e-15);
  }
}

TEST(TrajectoryFile, TumLinesLookAsOtherProgramsExpect) {
  const TimedPose pose{12.5, SE3(Eigen::Quaterniond(0, 1, 0, 0), {1.0, -2.25, 0.1})};
  EXPECT_EQ(TumLine(pose), "12.500000000 1 -2.25 0.1 1 0 0 0\n");
  EXPECT_EQ(KittiLine(SE3()), "1 0 0 0 0 1 0 0 0 0 1 0\n");
}

TEST(TrajectoryFile, KittiRoundTripNeedsTheStamps) {
  const TemporaryFolder folder;
  const Trajectory trajectory = RandomTrajectory(5);
  const auto path = folder.Path() / "poses.txt";
  ASSERT_TRUE(WriteKittiPoses(path, trajectory));
  std::vector<double> stamps;
  for (const TimedPose& pose : trajectory) stamps.push_back(pose.stamp_s);
  const auto read = LoadTrajectory(path, stamps);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT(Distance(read->back().T_world_sensor, trajectory.back().T_world_sensor), 1e-14);
  EXPECT_EQ(read->back().stamp_s, trajectory.back().stamp_s);
  stamps.pop_back();
  EXPECT_NE(LoadTrajectory(path, stamps).error().message.find("5 poses for 4"), std::string::npos);
}

TEST(TrajectoryFile, TheNumberOfColumnsTellsTheFormat) {
  const TemporaryFolder folder;
  const auto tum = folder.Put("tum", "# comment\n\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 0.999\n");
  ASSERT_TRUE(LoadTrajectory(tum, {}));
  EXPECT_EQ(LoadTrajectory(tum, {})->size(), 2u);
  const auto other = folder.Put("other", "1 2 3\n");
  EXPECT_NE(LoadTrajectory(other, {}).error().message.find("other:1"), std::string::npos);
  EXPECT_FALSE(LoadTrajectory(folder.Put("empty", ""), {}));
  EXPECT_FALSE(LoadTrajectory(folder.Path() / "missing", {}));
}

TEST(TrajectoryFile, DamagedLinesAreErrorsWithTheirNumber) {
  const TemporaryFolder folder;
  const std::string good = "# t x y z q\n1 0 0 0 0 0 0 1\n";
  for (const char* bad : {"2 0 0 0 0 0 0",
                          "2 0 0 0 0 0 0 x",
                          "2 0 0 0 0 0 0 0",
                          "2 nan 0 0 0 0 0 1",
                          "1 0 0 0 0 0 0 1",
                          "0.5 0 0 0 0 0 0 1"}) {
    const auto read = ReadTum(folder.Put("t.txt", good + bad + "\n"));
    ASSERT_FALSE(read) << bad;
    EXPECT_NE(read.error().message.find("t.txt:3"), std::string::npos) << read.error().message;
  }
  for (const char* bad : {"1 0 0 0 0 1 0 0 0 0 1",
                          "2 0 0 0 0 1 0 0 0 0 1 0",
                          "1 0 0 0 0 1 0 0 0 0 -1 0",
                          "1 0 0 inf 0 1 0 0 0 0 1 0"}) {
    EXPECT_FALSE(ReadKittiPoses(folder.Put("k.txt", std::string(bad) + "\n"))) << bad;
  }
}

TEST(TrajectoryFile, StampsAreOneNumberPerLine) {
  const TemporaryFolder folder;
  EXPECT_EQ(ReadStamps(folder.Put("a", "0\n1.5e-1\n+2\n")).value(),
            (std::vector<double>{0.0, 0.15, 2.0}));
  EXPECT_NE(ReadStamps(folder.Put("b", "0\nzwei\n")).error().message.find("b:2"),
            std::string::npos);
  EXPECT_FALSE(ReadStamps(folder.Put("c", "1\n0\n")));
  EXPECT_FALSE(ReadStamps(folder.Put("d", "1 2\n")));
}

TEST(GroundTruth, NothingIsNotAnError) {
  const TemporaryFolder folder;
  const auto truth = FindGroundTruth(folder.Path());
  ASSERT_TRUE(truth);
  EXPECT_FALSE(truth->has_value());
}

TEST(GroundTruth, TheDenseTruthComesFirst) {
  const TemporaryFolder folder;
  folder.Put("times.txt", "5\n6\n");
  folder.Put("poses.txt", "1 0 0 1 0 1 0 0 0 0 1 0\n1 0 0 2 0 1 0 0 0 0 1 0\n");
  auto truth = FindGroundTruth(folder.Path()).value();
  ASSERT_TRUE(truth.has_value());
  EXPECT_EQ(truth->path.filename(), "poses.txt");
  EXPECT_EQ(truth->trajectory[1].stamp_s, 6.0);
  EXPECT_EQ(truth->trajectory[1].T_world_sensor.Translation().x(), 2.0);
  folder.Put("gt_tum.txt", "1 7 0 0 0 0 0 1\n");
  truth = FindGroundTruth(folder.Path()).value();
  EXPECT_EQ(truth->path.filename(), "gt_tum.txt");
  EXPECT_EQ(truth->trajectory[0].T_world_sensor.Translation().x(), 7.0);
}

TEST(GroundTruth, WithoutTimesScansAreAtEvenTimes) {
  const TemporaryFolder folder;
  folder.Put("poses.txt", KittiLine(SE3()) + KittiLine(SE3()));
  const auto truth = FindGroundTruth(folder.Path(), 0.25).value();
  EXPECT_EQ(truth->trajectory[1].stamp_s, 0.25);
}

TEST(GroundTruth, KittiOdometryPosesAreTurnedFromTheCameraToTheLidar) {
  const TemporaryFolder folder;
  // Camera z is the LiDAR's x, camera x its -y; the camera moves 1 m forward.
  folder.Put("sequences/04/calib.txt", "P0: 1 2\nTr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 -0.3\n");
  folder.Put("sequences/04/times.txt", "0\n0.1\n");
  folder.Put("poses/04.txt", KittiLine(SE3()) + "1 0 0 0 0 1 0 0 0 0 1 1\n");
  const auto truth = FindGroundTruth(folder.Path() / "sequences/04/");
  ASSERT_TRUE(truth) << truth.error().message;
  ASSERT_TRUE(truth->has_value());
  const Eigen::Vector3d moved = (*truth)->trajectory[1].T_world_sensor.Translation();
  EXPECT_LT((moved - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  folder.Put("sequences/04/calib.txt", "P0: 1 2\nTr: 0 -1 0\n");
  EXPECT_NE(FindGroundTruth(folder.Path() / "sequences/04").error().message.find("calib.txt:2"),
            std::string::npos);
  folder.Put("sequences/04/calib.txt", "P0: 1 2\n");
  EXPECT_FALSE(FindGroundTruth(folder.Path() / "sequences/04"));
}

}  // namespace
}  // namespace covsplat
