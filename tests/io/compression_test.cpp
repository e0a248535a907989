#include "covsplat/io/compression.hpp"

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

/// Half of it compresses, half of it does not.
std::string Sample(std::size_t size) {
  Rng rng(1);
  std::string bytes(size, 'a');
  for (std::size_t i = size / 2; i < size; ++i) bytes[i] = static_cast<char>(rng.NextU64());
  return bytes;
}

TEST(Compression, TheChecksumIsTheCommonOne) {
  EXPECT_EQ(Crc32("123456789"), 0xCBF43926u);  // the check value of CRC-32
  EXPECT_EQ(Crc32("6789", Crc32("12345")), 0xCBF43926u);
}

TEST(Compression, StreamsOfAllSizesComeBack) {
  for (const std::size_t size : {0u, 1u, 1000u, 65536u, 300000u}) {
    const std::string bytes = Sample(size);
    EXPECT_EQ(Inflate(Deflate(bytes), size), bytes) << size;
    EXPECT_EQ(Gunzip(Gzip(bytes), size), bytes) << size;
  }
  EXPECT_LT(Deflate(Sample(100000)).size(), 52000u);
}

TEST(Compression, AStreamOfAnotherSizeIsRefused) {
  const std::string stream = Deflate(Sample(1000));
  EXPECT_FALSE(Inflate(stream, 999));
  EXPECT_FALSE(Inflate(stream, 1001));
  EXPECT_FALSE(Inflate(stream, std::size_t{1} << 60));  // and nothing of that size is allocated
  EXPECT_FALSE(Inflate(stream + "x", 1000));
  EXPECT_FALSE(Gunzip(Gzip(Sample(1000)), 999));
  EXPECT_FALSE(Gunzip(Gzip(Sample(1000)) + "x", 1000));
}

TEST(Compression, TruncatedAndChangedDataNeverPassesForOther) {
  const std::string bytes = Sample(200);
  const std::string stream = Deflate(bytes);
  const std::string file = Gzip(bytes);
  for (std::size_t i = 0; i < stream.size(); ++i) {
    EXPECT_FALSE(Inflate(std::string_view(stream).substr(0, i), bytes.size())) << i;
  }
  for (std::size_t i = 0; i < file.size(); ++i) {
    EXPECT_FALSE(Gunzip(std::string_view(file).substr(0, i), bytes.size())) << i;
  }
  constexpr std::size_t kGzipHeader = 10;  // its time and system are free
  for (std::size_t i = kGzipHeader; i < file.size(); ++i) {
    std::string damaged = file;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    const auto read = Gunzip(damaged, bytes.size());
    EXPECT_TRUE(!read || *read == bytes) << i;  // a run may be told in two ways
  }
}

TEST(Compression, TheStartOfAFileIsReadAlone) {
  const std::string file = Gzip(Sample(100000));
  EXPECT_EQ(GunzipStart(file, 16), std::string(16, 'a'));
  EXPECT_EQ(GunzipStart(file.substr(0, file.size() / 2), 16), std::string(16, 'a'));
  EXPECT_EQ(GunzipStart("no gzip", 16), "");
}

}  // namespace
}  // namespace covsplat
