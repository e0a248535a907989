#include "covsplat/mapping/compact_map.hpp"

#include <algorithm>
#include <limits>
#include <numbers>

#include "tests/support/random_map.hpp"
#include <gtest/gtest.h>

#include "covsplat/io/binary.hpp"
#include "covsplat/io/compression.hpp"
#include "covsplat/io/text.hpp"
#include "covsplat/mapping/compact_tile.hpp"

namespace covsplat {
namespace {

using test::AngleBetween;
using test::CovarianceOf;
using test::RandomMap;
using test::SetGaussian;

constexpr std::size_t kHeaderBytes = 28;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

SavedMap Read(const std::string& bytes) {
  const Result<SavedMap> map = ParseCompactMap(bytes, "a.csmap");
  EXPECT_TRUE(map) << map.error().message;
  return map.value_or(SavedMap());
}

std::string ErrorOf(const std::string& bytes) {
  const Result<SavedMap> map = ParseCompactMap(bytes, "a.csmap");
  if (map) return "no error";
  EXPECT_EQ(map.error().code, ErrorCode::kInput);
  EXPECT_NE(map.error().message.find("a.csmap: "), std::string::npos);
  return map.error().message;
}

/// The rows in the order in which a file has them.
SavedMap Sorted(const SavedMap& map) {
  std::vector<std::size_t> rows;
  for (const TileRows& tile : SortIntoTiles(map)) {
    rows.insert(rows.end(), tile.rows.begin(), tile.rows.end());
  }
  return SelectRows(map, rows);
}

std::string Header(std::uint32_t version, std::uint32_t sections, std::uint64_t gaussians) {
  std::string bytes(kCompactMapMagic);
  AppendBinary(bytes, version);
  AppendBinary(bytes, sections);
  AppendBinary(bytes, gaussians);
  AppendBinary(bytes, Crc32(bytes));
  return bytes;
}

std::string Section(const std::string& tag, const std::string& payload) {
  std::string bytes = tag;
  AppendBinary(bytes, static_cast<std::uint32_t>(payload.size()));
  AppendBinary(bytes, Crc32(payload, Crc32(bytes)));
  return bytes + payload;
}

TEST(CompactMap, EverythingComesBackWithinHalfAStep) {
  const SavedMap map = Sorted(RandomMap(3000, 150.0, 1));
  const SavedMap read = Read(PackCompactMap(map));
  ASSERT_EQ(read.Size(), map.Size());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const auto gap = [&](Parameter p) {
      return std::abs(read.gaussians.Column(p)[i] - map.gaussians.Column(p)[i]);
    };
    for (const Parameter p : {kMeanX, kMeanY, kMeanZ}) EXPECT_LE(gap(p), 0.5f / 2048.0f + 2e-5f);
    for (const Parameter p : {kLogScaleU, kLogScaleV, kOpacityLogit}) {
      EXPECT_LE(gap(p), 0.5f / 64.0f + 1e-5f);
    }
    EXPECT_LT(AngleBetween(NormalOf(read.gaussians, i), NormalOf(map.gaussians, i)), 1e-3);
    EXPECT_NEAR(RotationOf(read.gaussians, i).norm(), 1.0f, 1e-6f);
    // A scale that is off by 1/128 and a twist by pi/512 change the covariance by 3 %.
    const Eigen::Matrix3d covariance = CovarianceOf(map, i);
    EXPECT_LT((CovarianceOf(read, i) - covariance).norm(), 0.03 * covariance.norm());
    EXPECT_NEAR(read.confidence[i], map.confidence[i], 0.5f / 255.0f + 1e-6f);
    EXPECT_NEAR(read.control_score[i], map.control_score[i], 0.5f / 254.0f + 1e-6f);
    EXPECT_NEAR(read.intensity[i], map.intensity[i], 0.008f * map.intensity[i]);
  }
  EXPECT_EQ(read.keyframe, map.keyframe);
  EXPECT_EQ(read.last_seen, map.last_seen);
  EXPECT_EQ(read.config_yaml, map.config_yaml);
  ASSERT_TRUE(read.sensor);
  EXPECT_EQ(read.sensor->Elevations(), map.sensor->Elevations());
  EXPECT_EQ(read.sensor->Columns(), 1024);
  EXPECT_EQ(read.sensor->MinRange(), 0.5);
  EXPECT_EQ(read.sensor->MaxRange(), 80.0);
  ASSERT_EQ(read.keyframes.size(), map.keyframes.size());
  for (std::size_t k = 0; k < map.keyframes.size(); ++k) {
    EXPECT_EQ(read.keyframes[k].stamp_s, map.keyframes[k].stamp_s);
    EXPECT_TRUE(read.keyframes[k].T_world_sensor.Matrix().isApprox(
        map.keyframes[k].T_world_sensor.Matrix(), 1e-15));
  }
}

TEST(CompactMap, ReadAndWrittenAgainItIsTheSameFile) {
  SavedMap map = RandomMap(5000, 100.0, 2);
  map.keyframes.clear();  // rotations are normalised when read: their last bit may change
  const std::string bytes = PackCompactMap(map);
  EXPECT_TRUE(PackCompactMap(Read(bytes)) == bytes);
}

TEST(CompactMap, TheOrderOfTheGaussiansDoesNotMatter) {
  const SavedMap map = RandomMap(500, 80.0, 3);
  std::vector<std::size_t> backwards(map.Size());
  for (std::size_t i = 0; i < map.Size(); ++i) backwards[i] = map.Size() - 1 - i;
  EXPECT_TRUE(PackCompactMap(SelectRows(map, backwards)) == PackCompactMap(map));
}

TEST(CompactMap, NormalsAlongTheAxesAreExact) {
  SavedMap map;
  map.Resize(6);
  for (int k = 0; k < 6; ++k) {
    const Eigen::Vector3f normal = (k < 3 ? 1.0f : -1.0f) * Eigen::Vector3f::Unit(k % 3);
    const Eigen::Quaternionf twist(Eigen::AngleAxisf(0.7f, Eigen::Vector3f::UnitZ()));
    const auto swing = Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), normal);
    const auto row = static_cast<std::size_t>(k);
    SetGaussian(
        map, row, {0.0f, 0.0f, 0.1f * static_cast<float>(k)}, swing * twist, {0.4f, 0.1f}, 1.0f);
  }
  map = Sorted(map);
  const SavedMap read = Read(PackCompactMap(map));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_LT(AngleBetween(NormalOf(read.gaussians, i), NormalOf(map.gaussians, i)), 1e-6);
    const Eigen::Matrix3d covariance = CovarianceOf(map, i);
    EXPECT_LT((CovarianceOf(read, i) - covariance).norm(), 0.02 * covariance.norm());
  }
}

TEST(CompactMap, FarAndNegativePlacesAreKept) {
  SavedMap map;
  map.Resize(4);
  const std::array<Eigen::Vector3f, 4> means = {Eigen::Vector3f(-0.0001f, 63.9999f, 64.0f),
                                                Eigen::Vector3f(-64.0f, -64.0001f, 0.0f),
                                                Eigen::Vector3f(5000.0f, -5000.0f, 12.0f),
                                                Eigen::Vector3f(1e6f, 0.0f, 0.0f)};
  for (std::size_t i = 0; i < 4; ++i) {
    SetGaussian(map, i, means[i], Eigen::Quaternionf::Identity(), {0.1f, 0.1f}, 0.0f);
  }
  map = Sorted(map);
  const SavedMap read = Read(PackCompactMap(map));
  ASSERT_EQ(read.Size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3f mean = MeanOf(map.gaussians, i);
    EXPECT_LT((MeanOf(read.gaussians, i) - mean).norm(), 6e-4f + 1e-7f * mean.norm());
  }
}

TEST(CompactMap, ExtremesAreLimitedAndWhatCannotBeDrawnIsLeftOut) {
  SavedMap map = RandomMap(6, 10.0, 4);
  map.gaussians.Column(kMeanX)[0] = kNaN;
  map.gaussians.Column(kOpacityLogit)[1] = std::numeric_limits<float>::infinity();
  for (int p = kQuatW; p <= kQuatZ; ++p) map.gaussians.Column(p)[2] = 0.0f;
  map.gaussians.Column(kMeanY)[3] = 1e30f;
  map.gaussians.Column(kLogScaleU)[4] = -1e30f;
  map.confidence[4] = kNaN;
  map.control_score[4] = kNaN;
  map.intensity[4] = kNaN;
  map.keyframe[4] = -7;
  map.confidence[5] = 3.0f;
  map.intensity[5] = std::numeric_limits<float>::infinity();
  const SavedMap read = Read(PackCompactMap(map));
  ASSERT_EQ(read.Size(), 2u);
  const std::size_t limited = read.keyframe[0] == -1 ? 0 : 1;
  EXPECT_EQ(read.gaussians.Column(kLogScaleU)[limited], -100.0f);
  EXPECT_EQ(read.confidence[limited], 0.0f);
  EXPECT_EQ(read.control_score[limited], -1.0f);
  EXPECT_EQ(read.intensity[limited], 0.0f);
  EXPECT_EQ(read.confidence[1 - limited], 1.0f);
}

TEST(CompactMap, AnEmptyMapIsAFile) {
  const std::string bytes = PackCompactMap(SavedMap());
  EXPECT_EQ(bytes.size(), kHeaderBytes);
  EXPECT_EQ(Read(bytes).Size(), 0u);
}

TEST(CompactMap, EveryFlippedBitIsFoundAndNamed) {
  const std::string bytes = PackCompactMap(RandomMap(20, 50.0, 5));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    const std::string error = ErrorOf(damaged);
    const char* place = bit / 8 < kCompactMapMagic.size() ? "does not start as one"
                        : bit / 8 < kHeaderBytes          ? "in its header"
                                                          : "in section ";
    ASSERT_NE(error.find(place), std::string::npos) << bit << ": " << error;
  }
}

TEST(CompactMap, EveryTruncationIsFoundAndNamed) {
  const std::string bytes = PackCompactMap(RandomMap(20, 50.0, 6));
  for (std::size_t size = kCompactMapMagic.size(); size < bytes.size(); ++size) {
    const std::string error = ErrorOf(bytes.substr(0, size));
    ASSERT_NE(error.find("is truncated"), std::string::npos) << size << ": " << error;
    ASSERT_NE(error.find("again"), std::string::npos) << error;
  }
  EXPECT_NE(ErrorOf(bytes + "x").find("1 further bytes"), std::string::npos);
}

TEST(CompactMap, DamageIsNamedByItsSection) {
  std::string bytes = PackCompactMap(RandomMap(20, 5.0, 7));
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  EXPECT_NE(ErrorOf(bytes).find("is damaged in section 11 of 11 (TILE, from byte "),
            std::string::npos)
      << ErrorOf(bytes);
}

TEST(CompactMap, ANewerVersionAsksForANewerCovsplat) {
  const std::string error = ErrorOf(Header(kCompactMapVersion + 1, 0, 0));
  EXPECT_NE(error.find("has version 2"), std::string::npos) << error;
  EXPECT_NE(error.find("update covsplat"), std::string::npos) << error;
}

TEST(CompactMap, SectionsOfAnUnknownKindArePassedOver) {
  const SavedMap map = RandomMap(10, 5.0, 8);
  const std::string tile = Section("TILE", PackTile(map, SortIntoTiles(map).front()));
  const std::size_t count = SortIntoTiles(map).front().rows.size();
  EXPECT_EQ(Read(Header(1, 2, count) + Section("NEWS", "anything") + tile).Size(), count);
}

TEST(CompactMap, AbsurdCountsAreErrorsAndAllocateNothing) {
  constexpr auto kMost = std::numeric_limits<std::uint32_t>::max();
  EXPECT_NE(ErrorOf(Header(1, kMost, 0)).find("truncated"), std::string::npos);
  EXPECT_NE(ErrorOf(Header(1, 0, std::uint64_t{1} << 60)).find("holds 0 Gaussians"),
            std::string::npos);
  std::string tile(12, '\0');
  AppendBinary(tile, kMost);  // Gaussians
  AppendBinary(tile, std::int64_t{0});
  AppendBinary(tile, std::uint8_t{1});
  EXPECT_NE(ErrorOf(Header(1, 1, kMost) + Section("TILE", tile)).find("made a mistake"),
            std::string::npos);
  std::string config;
  AppendBinary(config, kMost);
  EXPECT_NE(ErrorOf(Header(1, 1, 0) + Section("CONF", config + Deflate("a"))).find("CONF"),
            std::string::npos);
}

TEST(CompactMap, ContentsThatNoWriterMakesAreErrors) {
  const SavedMap map = RandomMap(10, 5.0, 9);
  const std::string tile = PackTile(map, SortIntoTiles(map).front());
  EXPECT_FALSE(UnpackTile(tile + "x"));
  EXPECT_FALSE(UnpackTile(tile.substr(0, tile.size() - 1)));
  EXPECT_FALSE(UnpackTile(""));
  // The first column's smallest value, a position, becomes negative; a twist beyond half a turn
  // would likewise be out of bounds.
  std::string negative = tile;
  negative.replace(16, 8, std::string(8, '\xff'));
  EXPECT_FALSE(UnpackTile(negative));
  EXPECT_NE(ErrorOf(Header(1, 1, 0) + Section("KEYF", std::string(63, 'a'))).find("KEYF"),
            std::string::npos);
  EXPECT_NE(ErrorOf(Header(1, 1, 0) + Section("KEYF", std::string(64, '\0'))).find("KEYF"),
            std::string::npos);  // a rotation of no length
}

TEST(CompactMap, SensorsThatCannotBeAreErrors) {
  const auto error_of = [](std::uint32_t columns,
                           double min_range_m,
                           double max_range_m,
                           const std::vector<double>& elevation_rad) {
    std::string payload;
    AppendBinary(payload, columns);
    AppendBinary(payload, min_range_m);
    AppendBinary(payload, max_range_m);
    for (const double e : elevation_rad) AppendBinary(payload, e);
    return ErrorOf(Header(1, 1, 0) + Section("SENS", payload));
  };
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(512, 0.5, 80.0, {0.1, -0.1}), "no error");
  EXPECT_NE(error_of(510, 0.5, 80.0, {0.1, -0.1}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(0xfffffffc, 0.5, 80.0, {0.1, -0.1}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(512, 80.0, 0.5, {0.1, -0.1}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(512, 0.5, kNoNumber, {0.1, -0.1}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(512, 0.5, 80.0, {0.1}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(512, 0.5, 80.0, {0.1, 0.1}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(512, 0.5, 80.0, {0.1, kNoNumber}).find("SENS"), std::string::npos);
  EXPECT_NE(error_of(512, 0.5, 80.0, {0.1, -2.0}).find("SENS"), std::string::npos);
}

/// Three Gaussians that say all there is to say; the file of version 1 beside it never changes.
SavedMap GoldenMap() {
  SavedMap map;
  map.Resize(3);
  const auto half = std::numbers::sqrt2_v<float> / 2.0f;
  SetGaussian(map, 0, {1.0f, -2.0f, 0.5f}, {half, 0.0f, half, 0.0f}, {0.5f, 0.25f}, 2.0f);
  SetGaussian(map, 1, {-70.25f, 3.0f, 8.0f}, {1.0f, 0.0f, 0.0f, 0.0f}, {0.1f, 0.1f}, -1.0f);
  SetGaussian(map, 2, {1.25f, -2.0f, 0.5f}, {0.5f, 0.5f, 0.5f, 0.5f}, {1.0f, 0.05f}, 0.0f);
  map.confidence = {1.0f, 0.5f, 0.0f};
  map.control_score = {0.0f, -1.0f, 1.0f};
  map.intensity = {0.0f, 1.0f, 100.0f};
  map.keyframe = {0, 1, 1};
  map.last_seen = {1, 1, -1};
  map.keyframes = {{10.5, SE3()}, {11.0, SE3(Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0), {1, 2, 3})}};
  map.sensor = SensorModel({0.25, 0.125, -0.5}, 512, 0.5, 100.0);
  map.config_yaml = "sensor:\n  columns: 512\n";
  return map;
}

TEST(CompactMap, FilesOfVersionOneAreReadForEver) {
  const Result<std::string> bytes = ReadFile(COVSPLAT_GOLDEN "/map/version_1.csmap");
  ASSERT_TRUE(bytes) << bytes.error().message;
  const SavedMap read = Read(*bytes);
  ASSERT_EQ(read.Size(), 3u);
  const SavedMap map = Sorted(GoldenMap());
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((MeanOf(read.gaussians, i) - MeanOf(map.gaussians, i)).norm(), 5e-4f) << i;
    EXPECT_LT(AngleBetween(NormalOf(read.gaussians, i), NormalOf(map.gaussians, i)), 1e-6) << i;
    const Eigen::Matrix3d covariance = CovarianceOf(map, i);
    EXPECT_LT((CovarianceOf(read, i) - covariance).norm(), 0.02 * covariance.norm()) << i;
    EXPECT_EQ(read.gaussians.Column(kOpacityLogit)[i], map.gaussians.Column(kOpacityLogit)[i]);
    EXPECT_NEAR(read.confidence[i], map.confidence[i], 0.002f) << i;
    EXPECT_EQ(read.control_score[i], map.control_score[i]) << i;
    EXPECT_NEAR(read.intensity[i], map.intensity[i], 0.008f * map.intensity[i]) << i;
  }
  EXPECT_EQ(read.keyframe, map.keyframe);
  EXPECT_EQ(read.last_seen, map.last_seen);
  EXPECT_EQ(read.config_yaml, map.config_yaml);
  ASSERT_TRUE(read.sensor);
  EXPECT_EQ(read.sensor->Elevations(), map.sensor->Elevations());
  EXPECT_EQ(read.sensor->Columns(), 512);
  ASSERT_EQ(read.keyframes.size(), 2u);
  EXPECT_EQ(read.keyframes[1].stamp_s, 11.0);
  EXPECT_TRUE(
      read.keyframes[1].T_world_sensor.Matrix().isApprox(map.keyframes[1].T_world_sensor.Matrix()));
  // What is written today says the same.
  EXPECT_TRUE(PackCompactMap(Read(PackCompactMap(map))) == PackCompactMap(read));
}

}  // namespace
}  // namespace covsplat
