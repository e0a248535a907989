// The readers and the sensor estimate on real recordings, which are not part of the repository.
#include <array>
#include <cstring>
#include <iostream>

#include "tests/support/data.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/sensor_estimate.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/io/scan_source.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/io/trajectory_file.hpp"

namespace covsplat {
namespace {

constexpr double kDegree = 3.14159265358979 / 180.0;

std::vector<Scan> FirstScans(const std::filesystem::path& folder, std::int64_t count) {
  SourceOptions options;
  options.max_scans = count;
  auto source = OpenScanSource(folder, options);
  std::vector<Scan> scans;
  if (!source) return scans;
  while (auto scan = (*source)->Next().value_or(std::nullopt)) scans.push_back(std::move(*scan));
  return scans;
}

TEST(RealData, KittiRawHas64UnevenBeams) {
  const auto folder = TestData("kitti_raw_0005");
  if (!folder) GTEST_SKIP() << kNoTestData;
  const SensorEstimate estimate = EstimateSensorModel(FirstScans(*folder, 5), {});
  std::cout << estimate.verdict << "\n";
  EXPECT_EQ(estimate.basis, RowBasis::kBeams);
  const std::vector<double>& elevations = estimate.model.Elevations();
  ASSERT_EQ(elevations.size(), 64u);
  EXPECT_NEAR(elevations.front() / kDegree, 2.0, 0.5);
  EXPECT_NEAR(elevations.back() / kDegree, -24.3, 0.8);
  EXPECT_LT(elevations[10] - elevations[20], 0.8 * (elevations[40] - elevations[50]));
  EXPECT_EQ(estimate.model.Columns(), 1024);
}

TEST(RealData, LivoxGetsEvenRowsOfItsDensity) {
  const auto folder = TestData("hku_1_kf");
  if (!folder) GTEST_SKIP() << kNoTestData;
  const SensorEstimate estimate = EstimateSensorModel(FirstScans(*folder, 10), {});
  std::cout << estimate.verdict << "\n";
  EXPECT_EQ(estimate.basis, RowBasis::kUniform);
  EXPECT_NEAR(estimate.model.Columns(), 400, 80);
  EXPECT_NEAR(estimate.model.Rows(), 80, 20);
}

TEST(RealData, OusterHas64EvenBeams) {
  const auto folder = TestData("newer_college_06");
  if (!folder) GTEST_SKIP() << kNoTestData;
  std::vector<Scan> scans;
  for (const char* name : {"raw_00.bin", "raw_01.bin", "raw_02.bin"}) {
    const std::string bytes = ReadFile(*folder / name).value();
    scans.emplace_back();
    for (std::size_t at = 0; at + 12 <= bytes.size(); at += 12) {
      std::array<float, 3> p{};
      std::memcpy(p.data(), bytes.data() + at, sizeof(p));
      scans.back().points.emplace_back(p[0], p[1], p[2]);
    }
  }
  const SensorEstimate estimate = EstimateSensorModel(scans, {});
  std::cout << estimate.verdict << "\n";
  EXPECT_EQ(estimate.basis, RowBasis::kBeams);
  ASSERT_EQ(estimate.model.Rows(), 64);
  EXPECT_NEAR(estimate.model.Elevations().front() / kDegree, 17.74, 0.1);
  EXPECT_NEAR(estimate.model.Elevations().back() / kDegree, -15.59, 0.1);
}

TEST(RealData, WholeRecordingsAreReadWithTheirReferences) {
  const auto folder = TestData("kitti_raw_0005");
  if (!folder) GTEST_SKIP() << kNoTestData;
  const std::vector<Scan> scans = FirstScans(*folder, -1);
  ASSERT_EQ(scans.size(), 80u);
  const auto stamps = ReadStamps(*folder / "times.txt");
  ASSERT_TRUE(stamps.has_value());
  EXPECT_EQ(scans[79].stamp_s, stamps->back());
  const auto reference = LoadTrajectory(*folder / "poses_reference.txt", *stamps);
  ASSERT_TRUE(reference.has_value()) << reference.error().message;
  EXPECT_EQ(reference->size(), 80u);
}

TEST(RealData, MeshesAndCloudsOfOtherProgramsAreRead) {
  const auto mesh_file = TestData("small_warehouse/small_warehouse.ply");
  const auto cloud_file = TestData("pair_small/source.ply");
  if (!mesh_file || !cloud_file) GTEST_SKIP() << kNoTestData;
  const auto mesh = ReadTriangleMesh(*mesh_file);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->vertices.size(), 9713u);
  EXPECT_EQ(mesh->triangles.size(), 15003u);
  const auto cloud = ReadPly(*cloud_file);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().message;
  EXPECT_EQ(cloud->Rows(), 69792u);
}

}  // namespace
}  // namespace covsplat
