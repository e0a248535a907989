#include "covsplat/mapping/map_spz.hpp"

#include <numbers>

#include "tests/support/random_map.hpp"
#include <gtest/gtest.h>

#include "covsplat/io/binary.hpp"
#include "covsplat/io/compression.hpp"

namespace covsplat {
namespace {

using test::AngleBetween;
using test::RandomMap;
using test::SetGaussian;

constexpr std::size_t kHeaderBytes = 16;

std::string Unpacked(const SavedMap& map) {
  const Result<std::string> file = PackSpz(map, "a.spz");
  EXPECT_TRUE(file) << file.error().message;
  return Gunzip(*file, std::size_t{1} << 30).value();
}

std::string ErrorOf(const std::string& file) {
  const Result<SpzFile> read = ParseSpz(file, "a.spz");
  if (read) return "no error";
  EXPECT_EQ(read.error().code, ErrorCode::kInput);
  EXPECT_NE(read.error().message.find("a.spz: "), std::string::npos);
  return read.error().message;
}

std::string Header(std::uint32_t version, std::uint32_t gaussians, std::uint8_t sh_degree = 0) {
  std::string bytes = "NGSP";
  AppendBinary(bytes, version);
  AppendBinary(bytes, gaussians);
  AppendBinary(bytes, sh_degree);
  AppendBinary(bytes, std::uint8_t{12});
  AppendBinary(bytes, std::uint16_t{0});
  return bytes;
}

/// A Gaussian at x = 1 (right) y = 2 (up) z = -3 (forward), half opaque, e^-2 by e^-3 m and flat.
std::string OneGaussian(const std::string& rotation, const std::string& harmonics = "") {
  std::string bytes;
  for (const int steps : {4096, 8192, -12288}) {
    for (int shift = 0; shift < 24; shift += 8) bytes.push_back(static_cast<char>(steps >> shift));
  }
  bytes += std::string("\x80\x80\x80\x80", 4);  // opacity, colour
  bytes += std::string("\x80\x70\x0d", 3);      // 16 * (10 - 2), 16 * (10 - 3), thin
  return bytes + rotation + harmonics;
}

TEST(Spz, TheBytesAreThoseOfTheFormat) {
  SavedMap map;
  map.Resize(1);
  // Faces back to the sensor: the normal is -x of the map, which is SPZ's +z.
  const auto q =
      Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), -Eigen::Vector3f::UnitX());
  SetGaussian(map, 0, {3.0f, -1.0f, 2.0f}, q, {std::exp(-2.0f), std::exp(-3.0f)}, 0.0f);
  const std::string bytes = Unpacked(map);
  ASSERT_EQ(bytes.size(), kHeaderBytes + 20);
  EXPECT_EQ(bytes.substr(0, kHeaderBytes), Header(3, 1));
  EXPECT_EQ(bytes.substr(kHeaderBytes, 9), OneGaussian("").substr(0, 9));
  EXPECT_EQ(static_cast<unsigned char>(bytes[kHeaderBytes + 9]), 0x80);
  // The colour of the normal (-1, 0, 0): 0 of red, half of the others, as SPZ spreads them.
  const auto red = static_cast<unsigned char>(bytes[kHeaderBytes + 10]);
  EXPECT_NEAR(0.5 + 0.28209479 * (red / 255.0 - 0.5) / 0.15, 0.0, 0.01);
  EXPECT_EQ(static_cast<unsigned char>(bytes[kHeaderBytes + 11]), 0x80);
  EXPECT_EQ(bytes.substr(kHeaderBytes + 13, 3), std::string("\x80\x70\x0d", 3));
}

TEST(Spz, PlacesShapesAndOpacitiesComeBack) {
  const SavedMap map = RandomMap(2000, 150.0, 1);
  const Result<SpzFile> read = ParseSpz(PackSpz(map, "a.spz").value(), "a.spz");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->version, 3);
  ASSERT_EQ(read->map.Size(), map.Size());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const GaussianColumns<float>& got = read->map.gaussians;
    EXPECT_LT((MeanOf(got, i) - MeanOf(map.gaussians, i)).lpNorm<Eigen::Infinity>(), 1.5e-4f);
    EXPECT_LT(AngleBetween(NormalOf(got, i), NormalOf(map.gaussians, i)), 5e-3);
    for (const Parameter p : {kLogScaleU, kLogScaleV}) {
      EXPECT_NEAR(got.Column(p)[i], map.gaussians.Column(p)[i], 0.5f / 16.0f + 1e-5f);
    }
    EXPECT_NEAR(OpacityOf(got, i), OpacityOf(map.gaussians, i), 0.5f / 255.0f + 1e-5f);
    const Eigen::Matrix3d covariance = test::CovarianceOf(map, i);
    EXPECT_LT((test::CovarianceOf(read->map, i) - covariance).norm(), 0.08 * covariance.norm());
  }
  EXPECT_EQ(read->map.keyframe, std::vector<int>(map.Size(), -1));
  EXPECT_TRUE(read->map.keyframes.empty());
}

TEST(Spz, MapsOfKilometresGiveUpStepsForReach) {
  SavedMap map;
  map.Resize(1);
  SetGaussian(map, 0, {5000.3f, -3.0f, 1.0f}, Eigen::Quaternionf::Identity(), {0.1f, 0.1f}, 0.0f);
  const Result<SpzFile> read = ParseSpz(PackSpz(map, "a.spz").value(), "a.spz");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT((MeanOf(read->map.gaussians, 0) - MeanOf(map.gaussians, 0)).norm(), 2e-3f);
  map.gaussians.Column(kMeanX)[0] = 1e7f;
  const Result<std::string> refused = PackSpz(map, "a.spz");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutput);
  EXPECT_NE(refused.error().message.find(".ply"), std::string::npos);
}

TEST(Spz, FilesOfOthersAreRead) {
  std::string no_turn_v3;  // w, the fourth of x y z w, is the largest; the others are 0
  AppendBinary(no_turn_v3, std::uint32_t{3} << 30);
  const std::array<std::string, 3> files = {
      Header(3, 1) + OneGaussian(no_turn_v3),
      Header(2, 1) + OneGaussian("\x80\x80\x80"),
      Header(3, 1, 1) + OneGaussian(no_turn_v3, "harmonics") + "what a vendor adds"};
  for (const std::string& bytes : files) {
    const Result<SpzFile> read = ParseSpz(Gzip(bytes), "a.spz");
    ASSERT_TRUE(read) << read.error().message;
    const GaussianColumns<float>& got = read->map.gaussians;
    ASSERT_EQ(got.Size(), 1u);
    EXPECT_TRUE(MeanOf(got, 0).isApprox(Eigen::Vector3f(3.0f, -1.0f, 2.0f)));
    // Thin along SPZ's z, which points back: the map's -x. 128 of 255 in version 2 is nearly 0.
    EXPECT_LT(AngleBetween(NormalOf(got, 0), -Eigen::Vector3f::UnitX()), 0.02);
    EXPECT_FLOAT_EQ(got.Column(kLogScaleU)[0], -2.0f);
    EXPECT_FLOAT_EQ(got.Column(kLogScaleV)[0], -3.0f);
    EXPECT_NEAR(OpacityOf(got, 0), 0.5f, 0.003f);
  }
}

TEST(Spz, DamageIsFound) {
  const std::string file = PackSpz(RandomMap(20, 5.0, 2), "a.spz").value();
  constexpr std::size_t kGzipHeader = 10;
  for (std::size_t i = kGzipHeader; i < file.size(); ++i) {
    std::string damaged = file;
    damaged[i] = static_cast<char>(damaged[i] ^ 4);
    ASSERT_NE(ErrorOf(damaged), "no error") << i;
    ASSERT_NE(ErrorOf(file.substr(0, i)), "no error") << i;
  }
  EXPECT_NE(ErrorOf(file.substr(0, file.size() - 9)).find("truncated"), std::string::npos);
}

TEST(Spz, WrongHeadersAreErrorsThatSayWhatToDo) {
  EXPECT_NE(ErrorOf(Gzip("hello, this is text")).find("neither an SPZ file"), std::string::npos);
  EXPECT_NE(ErrorOf(Gzip(Header(1, 0))).find("SPZ of version 1"), std::string::npos);
  EXPECT_NE(ErrorOf(Gzip(Header(4, 0))).find("reads 2 and 3"), std::string::npos);
  EXPECT_NE(ErrorOf(Gzip(Header(3, 0, 9))).find("degree 9"), std::string::npos);
  EXPECT_NE(ErrorOf(Gzip(Header(3, 0xffffffff) + "short")).find("does not unpack"),
            std::string::npos);
}

}  // namespace
}  // namespace covsplat
