#include "covsplat/io/recording_writer.hpp"

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

#include "covsplat/io/ground_truth.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/io/scan_source.hpp"

namespace covsplat {
namespace {

Scan MakeScan(double stamp_s, std::size_t points) {
  Scan scan;
  scan.stamp_s = stamp_s;
  for (std::size_t i = 0; i < points; ++i) {
    scan.points.emplace_back(static_cast<float>(i), 2.0f, 3.0f);
    scan.intensity.push_back(0.25f);
    scan.time_offset_s.push_back(0.01f * static_cast<float>(i));
  }
  return scan;
}

SE3 PoseAtX(double x) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0.0, 0.0)}; }

void WriteRecording(const std::filesystem::path& folder, const std::vector<Scan>& scans) {
  auto writer = RecordingWriter::Create(folder, true);
  ASSERT_TRUE(writer) << writer.error().message;
  for (const Scan& scan : scans) ASSERT_TRUE(writer->Write(scan, PoseAtX(scan.stamp_s)));
  ASSERT_TRUE(writer->Finish({{0.0, PoseAtX(0.0)}, {9.0, PoseAtX(9.0)}}));
}

std::vector<Scan> ReadAll(const std::filesystem::path& folder) {
  auto source = OpenScanSource(folder, {});
  EXPECT_TRUE(source) << source.error().message;
  std::vector<Scan> scans;
  if (!source) return scans;
  while (true) {
    auto scan = (*source)->Next();
    EXPECT_TRUE(scan) << scan.error().message;
    if (!scan || !scan->has_value()) return scans;
    scans.push_back(std::move(**scan));
  }
}

TEST(RecordingWriter, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  const auto path = folder.Path() / "deep/recording";
  const std::vector<Scan> scans = {MakeScan(0.0, 0), MakeScan(0.1, 5), MakeScan(0.2, 3)};
  WriteRecording(path, scans);
  const std::vector<Scan> read = ReadAll(path);
  ASSERT_EQ(read.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read[i].index, static_cast<std::int64_t>(i));
    EXPECT_EQ(read[i].stamp_s, scans[i].stamp_s);
    EXPECT_EQ(read[i].points, scans[i].points);
    EXPECT_EQ(read[i].intensity, scans[i].intensity);
    EXPECT_EQ(read[i].time_offset_s, scans[i].time_offset_s);
  }
  const auto truth = FindGroundTruth(path);
  ASSERT_TRUE(truth && truth->has_value());
  EXPECT_EQ((*truth)->trajectory.back().stamp_s, 9.0);
}

TEST(RecordingWriter, LabelsAreWrittenAsSemanticKittiHasThem) {
  const TemporaryFolder folder;
  Scan empty = MakeScan(0.0, 0);
  Scan scan = MakeScan(0.1, 3);
  scan.label = {0, 252, 254};
  WriteRecording(folder.Path(), {empty, scan});
  EXPECT_EQ(folder.Get("labels/000000.label"), "");
  EXPECT_EQ(folder.Get("labels/000001.label"), std::string("\0\0\0\0\xfc\0\0\0\xfe\0\0\0", 12));
  EXPECT_EQ(ReadAll(folder.Path()).size(), 2u) << "labels are no scans";
}

TEST(RecordingWriter, MeshAndSensorLieBesideTheScansAndGoWithThem) {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f}};
  mesh.triangles = {{0, 1, 2}};
  {
    auto writer = RecordingWriter::Create(folder.Path(), false);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->WriteMesh(mesh));
    ASSERT_TRUE(writer->WriteSensor("sensor:\n  columns: 64\n"));
    ASSERT_TRUE(writer->Write(MakeScan(0.0, 4), PoseAtX(0.0)));
    ASSERT_TRUE(writer->Finish({{0.0, PoseAtX(0.0)}}));
  }
  const auto read = ReadTriangleMesh(folder.Path() / "gt_mesh.ply");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->vertices, mesh.vertices);
  EXPECT_EQ(read->triangles, mesh.triangles);
  EXPECT_EQ(folder.Get("sensor.yaml"), "sensor:\n  columns: 64\n");
  EXPECT_EQ(ReadAll(folder.Path()).size(), 1u) << "the mesh is no scan";
  WriteRecording(folder.Path(), {MakeScan(0.0, 2)});
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "gt_mesh.ply"));
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "sensor.yaml"));
}

TEST(RecordingWriter, ScansWithoutTimesOfPointsHaveNone) {
  const TemporaryFolder folder;
  Scan scan = MakeScan(0.0, 4);
  scan.time_offset_s.clear();
  WriteRecording(folder.Path(), {MakeScan(0.0, 0), scan});
  EXPECT_TRUE(ReadAll(folder.Path()).back().time_offset_s.empty());
}

TEST(RecordingWriter, AFolderThatIsNotEmptyIsRefused) {
  const TemporaryFolder folder;
  folder.Put("holiday.jpg", "dear");
  const auto writer = RecordingWriter::Create(folder.Path(), false);
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::kOutput);
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "velodyne"));
}

TEST(RecordingWriter, OverwritingReplacesALongerRecordingButNothingElse) {
  const TemporaryFolder folder;
  WriteRecording(folder.Path(), {MakeScan(0.0, 1), MakeScan(0.1, 2), MakeScan(0.2, 3)});
  folder.Put("holiday.jpg", "dear");
  WriteRecording(folder.Path(), {MakeScan(5.0, 4)});
  const std::vector<Scan> read = ReadAll(folder.Path());
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].points.size(), 4u);
  EXPECT_EQ(folder.Get("holiday.jpg"), "dear");
}

TEST(RecordingWriter, OverwritingThatWasInterruptedCanBeDoneAgain) {
  const TemporaryFolder folder;
  WriteRecording(folder.Path(), {MakeScan(0.0, 1), MakeScan(0.1, 2), MakeScan(0.2, 3)});
  // A folder that is not empty stops the removal half way.
  const std::filesystem::path second = folder.Path() / "velodyne/000001.bin";
  std::filesystem::remove(second);
  folder.Put("velodyne/000001.bin/obstacle", "");
  ASSERT_FALSE(RecordingWriter::Create(folder.Path(), true));
  EXPECT_TRUE(std::filesystem::exists(folder.Path() / "velodyne/000000.bin"));
  std::filesystem::remove_all(second);
  WriteRecording(folder.Path(), {MakeScan(5.0, 4)});
  EXPECT_EQ(ReadAll(folder.Path()).size(), 1u);
}

TEST(RecordingWriter, ScansOfSomeoneElseAreNeverOverwritten) {
  const TemporaryFolder folder;
  folder.Put("velodyne/000000.bin", "precious");
  ASSERT_FALSE(RecordingWriter::Create(folder.Path(), true));
  EXPECT_EQ(folder.Get("velodyne/000000.bin"), "precious");
}

TEST(RecordingWriter, AFolderThatCannotBeMadeIsAnError) {
  const TemporaryFolder folder;
  folder.Put("file", "");
  const auto writer = RecordingWriter::Create(folder.Path() / "file/recording", false);
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("Not a directory"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
