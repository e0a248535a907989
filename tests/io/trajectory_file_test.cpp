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

constexpr const char* kEuroc =
    "#timestamp [ns],p_x [m],p_y,p_z,q_w,q_x,q_y,q_z,v_x,v_y\n"
    "1403636580838555648,1,2,3,0.5,-0.5,0.5,-0.5,9,9\n"
    "1403636580843555648,1.5,2,3,1,0,0,0,9,9\n";
constexpr const char* kNewerCollege =
    "sec,nsec,x,y,z,qx,qy,qz,qw\r\n"
    "1583840211, 44547840, 1,2,3, -0.5,0.5,-0.5,0.5\r\n"
    "1583840211,144547840,1.5,2,3,0,0,0,1\r\n";

TEST(TrajectoryFile, EurocAndNewerCollegeAreToldByTheirColumns) {
  const TemporaryFolder folder;
  const SE3 first(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {1.0, 2.0, 3.0});
  for (const auto& [text, stamp] :
       {std::pair{kEuroc, 1403636580.838555648}, std::pair{kNewerCollege, 1583840211.044547840}}) {
    const auto read = LoadTrajectory(folder.Put("t.csv", text), {});
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->size(), 2u);
    EXPECT_NEAR(read->front().stamp_s, stamp, 1e-6);
    EXPECT_LT(Distance(read->front().T_world_sensor, first), 1e-12);
    EXPECT_EQ(read->back().T_world_sensor.Translation().x(), 1.5);
  }
}

TEST(TrajectoryFile, BadRowsOfCsvFilesAreNamedWithTheirLine) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    const auto read = LoadTrajectory(folder.Put("t.csv", text), {});
    return read ? std::string("no error") : read.error().message;
  };
  const auto says = [&](const std::string& text, const char* part) {
    EXPECT_NE(error(text).find(part), std::string::npos) << error(text);
  };
  const std::string euroc(kEuroc), newer(kNewerCollege);
  says(euroc + "1403636580843555649,1,x,3,1,0,0,0,9,9\n", "t.csv:4: holds something");
  says(euroc + "1403636580853555649,1,2,3,1,1,0,0,9,9\n", "t.csv:4: expected stamp");
  says(euroc + "1403636580,1,2,3,1,0,0,0,9,9\n", "t.csv:4: its time is not later");
  says("1403636580.5,1,2,3,1,0,0,0\n", "t.csv:1: expected stamp,x,y,z,qw");
  says(newer + "1583840212,-1,1,2,3,0,0,0,1\n", "t.csv:4: expected sec,nsec");
  says(newer + "1583840212,1,1,2,3,0,0,0\n", "t.csv:4: expected sec,nsec");
  says(newer + "1583840212,1,1,2,3,nan,0,0,1\n", "t.csv:4: expected sec,nsec");
  says("1,2,3,4,5\n", "t.csv:1: has 5 columns between commas");
  says("sec,nsec,x\n", "holds no poses");
  says("#only,names\n", "holds no poses");
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
