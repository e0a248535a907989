#include "covsplat/io/scan_source.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

#include "covsplat/io/kitti_scan.hpp"

namespace covsplat {
namespace {

std::string Bytes(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

const std::string kPoint = Bytes({1.0f, 2.0f, 3.0f, 0.5f});

std::string Pcd(const std::string& name, const std::string& rows, int points) {
  return fmt::format(
      "FIELDS x y z {}\nSIZE 4 4 4 8\nTYPE F F F F\nWIDTH {}\nPOINTS {}\nDATA ascii\n{}",
      name,
      points,
      points,
      rows);
}

std::unique_ptr<ScanSource> Open(const TemporaryFolder& folder, const SourceOptions& options = {}) {
  auto source = OpenScanSource(folder.Path(), options);
  EXPECT_TRUE(source) << source.error().message;
  return source ? std::move(*source) : nullptr;
}

void ExpectOpenError(const std::filesystem::path& path,
                     const std::string& words,
                     const SourceOptions& options = {}) {
  const auto source = OpenScanSource(path, options);
  ASSERT_FALSE(source);
  const std::string& message = source.error().message;
  EXPECT_NE(message.find(words), std::string::npos) << message;
  EXPECT_NE(message.find(path.filename().string()), std::string::npos) << message;
}

TEST(ScanSource, KittiFolderWithStampsAndPointTimes) {
  const TemporaryFolder folder;
  folder.Put("velodyne/000000.bin", kPoint + kPoint);
  folder.Put("velodyne/000001.bin", "");
  folder.Put("timestamps/000000.bin", Bytes({-0.05f, 0.05f}));
  folder.Put("timestamps/000001.bin", "");
  folder.Put("times.txt", "10.5\n10.6\n");
  const auto source = Open(folder);
  EXPECT_EQ(source->ScanCount(), 2);
  EXPECT_EQ(source->Description(), "KITTI folder, 2 scans, with times.txt, with time per point");
  const Scan first = source->Next()->value();
  EXPECT_EQ(first.stamp_s, 10.5);
  EXPECT_EQ(first.points[1], Eigen::Vector3f(1.0f, 2.0f, 3.0f));
  EXPECT_EQ(first.intensity[1], 0.5f);
  EXPECT_EQ(first.time_offset_s[0], -0.05f);
  EXPECT_NE(first.source.find("000000.bin"), std::string::npos);
  const Scan second = source->Next()->value();
  EXPECT_EQ(second.index, 1);
  EXPECT_TRUE(second.points.empty());
  EXPECT_FALSE(source->Next()->has_value());
  EXPECT_FALSE(source->Next()->has_value());
}

TEST(ScanSource, WithoutStampsScansAreAtEvenTimesAndInOrderOfTheirNumbers) {
  const TemporaryFolder folder;
  for (const char* name : {"scan_2.bin", "scan_10.bin", "scan_1.bin", "._scan_0.bin"}) {
    folder.Put(name, kPoint);
  }
  SourceOptions options;
  options.scan_period_s = 0.25;
  options.first_scan = 1;
  options.max_scans = 5;
  const auto source = Open(folder, options);
  EXPECT_EQ(source->ScanCount(), 2);
  const Scan scan = source->Next()->value();
  EXPECT_NE(scan.source.find("scan_2.bin"), std::string::npos);
  EXPECT_EQ(scan.index, 1);
  EXPECT_EQ(scan.stamp_s, 0.25);
  EXPECT_NE(source->Next()->value().source.find("scan_10.bin"), std::string::npos);
  EXPECT_FALSE(source->Next()->has_value());
}

TEST(ScanSource, ATruncatedScanIsAnErrorAndTheNextCallGoesOn) {
  const TemporaryFolder folder;
  const std::string whole = kPoint + kPoint;
  for (std::size_t cut = 0; cut <= 16; ++cut) {
    folder.Put(fmt::format("{:02}.bin", cut), whole.substr(0, whole.size() - cut));
  }
  const auto source = Open(folder);
  for (std::size_t cut = 0; cut <= 16; ++cut) {
    const auto scan = source->Next();
    EXPECT_EQ(scan.has_value(), cut % 16 == 0) << cut;
    if (scan) continue;
    EXPECT_NE(scan.error().message.find(fmt::format("{:02}.bin", cut)), std::string::npos);
    EXPECT_NE(scan.error().message.find(fmt::format("{} bytes", 32 - cut)), std::string::npos);
  }
  EXPECT_FALSE(source->Next()->has_value());
}

TEST(ScanSource, PointsThatAreNotFiniteAreKeptWithTheirTimes) {
  const TemporaryFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  folder.Put("0.bin", Bytes({nan, nan, nan, 0.0f}) + kPoint);
  folder.Put("timestamps/0.bin", Bytes({0.0f, 0.1f}));
  SourceOptions options;
  options.kitti_elevation_correction_deg = 0.2;
  const Scan scan = Open(folder, options)->Next()->value();
  ASSERT_EQ(scan.points.size(), 2u);
  EXPECT_TRUE(std::isnan(scan.points[0].x()));
  EXPECT_EQ(scan.time_offset_s[1], 0.1f);
}

TEST(ScanSource, PointTimesHaveToMatchThePoints) {
  const TemporaryFolder folder;
  folder.Put("0.bin", kPoint);
  folder.Put("1.bin", kPoint);
  folder.Put("timestamps/0.bin", Bytes({0.0f, 0.1f}));
  const auto source = Open(folder);
  EXPECT_NE(source->Next().error().message.find("8 bytes where 1 points need 4"),
            std::string::npos);
  EXPECT_NE(source->Next().error().message.find("No such file"), std::string::npos);
}

TEST(ScanSource, StampsHaveToMatchTheScans) {
  const TemporaryFolder folder;
  folder.Put("0.bin", kPoint);
  folder.Put("1.bin", kPoint);
  const std::string cases[][2] = {{"0\n", "1 lines for 2 scans"},
                                  {"0\nx\n", "times.txt:2"},
                                  {"0\n2011-13-01 00:00:00\n", ":2"}};
  for (const auto& [text, words] : cases) {
    folder.Put("times.txt", text);
    ExpectOpenError(folder.Path(), words);
  }
  folder.Put("beta.bin", kPoint);
  folder.Put("times.txt", "0\n1\n2\n3\n");
  ExpectOpenError(folder.Path(), "4 lines for 3");
}

TEST(ScanSource, APartOfARecordingTakesItsStampsByNumber) {
  const TemporaryFolder folder;
  folder.Put("velodyne/000001.bin", kPoint);
  folder.Put("velodyne/000003.bin", kPoint);
  folder.Put("times.txt", "0.0\n0.1\n0.2\n0.3\n");
  const auto source = Open(folder);
  EXPECT_EQ(source->Next()->value().stamp_s, 0.1);
  EXPECT_EQ(source->Next()->value().stamp_s, 0.3);
}

TEST(ScanSource, KittiAsItWasRecorded) {
  const TemporaryFolder folder;
  folder.Put("velodyne_points/data/0000000000.bin", kPoint);
  folder.Put("velodyne_points/data/0000000001.bin", kPoint);
  folder.Put("velodyne_points/timestamps.txt",
             "2011-09-26 13:02:25.594360375\n2011-09-26 13:02:25.697749613\n");
  const auto source = Open(folder);
  const double first_s = source->Next()->value().stamp_s;
  EXPECT_NEAR(first_s, 1317042145.594360, 1e-6);
  EXPECT_NEAR(source->Next()->value().stamp_s - first_s, 0.103389, 1e-6);
}

TEST(ScanSource, FoldersThatHoldNoRecordingAreErrorsThatSayWhatIsNeeded) {
  const TemporaryFolder folder;
  ExpectOpenError(folder.Path(), "empty folder");
  ExpectOpenError(folder.Path() / "missing", "does not exist");
  ExpectOpenError(folder.Put("notes.txt", ""), "not a folder");
  ExpectOpenError(folder.Path(), "*.bin (KITTI");
  folder.Put("a.pcd", "");
  folder.Put("b.PLY", "");
  ExpectOpenError(folder.Path(), "several kinds");
  SourceOptions kitti;
  kitti.format = ScanFormat::kKitti;
  ExpectOpenError(folder.Path(), "holds no scans", kitti);
  SourceOptions late;
  late.format = ScanFormat::kPly;
  late.first_scan = 1;
  ExpectOpenError(folder.Path(), "has 1 scans", late);
}

TEST(ScanSource, PcdFolderWithAbsoluteTimesTakesItsStampsFromThem) {
  const TemporaryFolder folder;
  folder.Put("1.pcd", Pcd("timestamp", "1 2 3 1700000000.0\n4 5 6 1700000000.1\n", 2));
  folder.Put("2.pcd", "garbage");
  folder.Put("3.pcd", Pcd("timestamp", "1 2 3 0\n4 5 6 0\n", 2));
  const auto source = Open(folder);
  const Scan first = source->Next()->value();
  EXPECT_EQ(first.stamp_s, 1.7e9);
  EXPECT_NEAR(first.time_offset_s[1], 0.1, 1e-6);
  EXPECT_FALSE(source->Next());
  const Scan third = source->Next()->value();
  EXPECT_NEAR(third.stamp_s, 0.2, 1e-12);
  EXPECT_TRUE(third.time_offset_s.empty());
}

TEST(ScanSource, PlyFolder) {
  const TemporaryFolder folder;
  folder.Put("1.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
             "property float z\nproperty float scalar_intensity\nend_header\n1 2 3 4\n");
  const auto source = Open(folder);
  EXPECT_EQ(source->Description(),
            "PLY folder, 1 scans, one scan every 0.1 s, time per point where the files have one");
  EXPECT_EQ(source->Next()->value().intensity[0], 4.0f);
}

TEST(KittiScan, RaisingKeepsRangeAndAzimuth) {
  const double angle = 0.2 * std::numbers::pi / 180.0;
  const std::array<Eigen::Vector3f, 4> before = {Eigen::Vector3f(10, 0, 0),
                                                 Eigen::Vector3f(-3, 4, -2),
                                                 Eigen::Vector3f(0, -7, 5),
                                                 Eigen::Vector3f(0, 0, 5)};
  std::array<Eigen::Vector3f, 4> after = before;
  RaiseElevation(after, angle);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto elevation = [](const Eigen::Vector3f& p) {
      return std::atan2(p.z(), std::hypot(p.x(), p.y()));
    };
    EXPECT_NEAR(after[i].norm(), before[i].norm(), 1e-5);
    EXPECT_NEAR(
        std::atan2(after[i].y(), after[i].x()), std::atan2(before[i].y(), before[i].x()), 1e-6);
    EXPECT_NEAR(elevation(after[i]) - elevation(before[i]), angle, 1e-6);
  }
  EXPECT_EQ(after[3], before[3]);
}

TEST(RecordingLayout, NumbersInNamesAreOrderedAsNumbers) {
  EXPECT_TRUE(NaturalLess("scan_2.bin", "scan_10.bin"));
  EXPECT_TRUE(NaturalLess("a1b2", "a1b10"));
  EXPECT_TRUE(NaturalLess("000009", "000010"));
  EXPECT_TRUE(NaturalLess("1583836591_9.pcd", "1583836592_1.pcd"));
  EXPECT_TRUE(NaturalLess("a", "ab"));
  EXPECT_FALSE(NaturalLess("7", "7"));
  EXPECT_NE(NaturalLess("007", "7"), NaturalLess("7", "007"));
}

}  // namespace
}  // namespace covsplat
