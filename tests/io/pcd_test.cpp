#include "covsplat/io/pcd.hpp"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <liblzf/lzf.h>

namespace covsplat {
namespace {

template <class T>
void Add(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string Header(std::size_t points, const std::string& data) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
      "FIELDS z x y _ ring t normal\nSIZE 4 4 8 1 2 4 4\nTYPE F F F U U U F\n"
      "COUNT 1 1 1 3 1 1 2\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
      points,
      points,
      data);
}

// Point i is at (i, 10 i, 100 i).
std::string BinaryBody(int points) {
  std::string body;
  for (int i = 0; i < points; ++i) {
    Add(body, 100.0f * static_cast<float>(i));
    Add(body, 1.0f * static_cast<float>(i));
    Add(body, 10.0 * i);
    body += "pad";
    Add(body, static_cast<std::uint16_t>(60000 + i));
    Add(body, static_cast<std::uint32_t>(4'000'000'000u) + static_cast<std::uint32_t>(i));
    Add(body, 0.5f);
    Add(body, -0.5f);
  }
  return body;
}

// Field by field, as binary_compressed has it before compression.
std::string PlanarBody(int points) {
  std::string body;
  for (int i = 0; i < points; ++i) Add(body, 100.0f * static_cast<float>(i));
  for (int i = 0; i < points; ++i) Add(body, 1.0f * static_cast<float>(i));
  for (int i = 0; i < points; ++i) Add(body, 10.0 * i);
  for (int i = 0; i < points; ++i) body += "pad";
  for (int i = 0; i < points; ++i) Add(body, static_cast<std::uint16_t>(60000 + i));
  for (int i = 0; i < points; ++i) {
    Add(body, static_cast<std::uint32_t>(4'000'000'000u) + static_cast<std::uint32_t>(i));
  }
  for (int i = 0; i < points; ++i) {
    Add(body, 0.5f);
    Add(body, -0.5f);
  }
  return body;
}

std::string CompressedFile(int points) {
  const std::string plain = PlanarBody(points);
  std::string packed(2 * plain.size() + 100, '\0');
  packed.resize(lzf_compress(plain.data(),
                             static_cast<unsigned>(plain.size()),
                             packed.data(),
                             static_cast<unsigned>(packed.size())));
  std::string file = Header(static_cast<std::size_t>(points), "binary_compressed");
  Add(file, static_cast<std::uint32_t>(packed.size()));
  Add(file, static_cast<std::uint32_t>(plain.size()));
  return file + packed;
}

void ExpectTable(const Result<PointTable>& table, std::size_t points) {
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->columns.size(), 7u);
  EXPECT_EQ(table->Find("_"), nullptr);
  for (const PointColumn& column : table->columns) ASSERT_EQ(column.Size(), points);
  const std::size_t last = points - 1;
  const auto n = static_cast<double>(last);
  EXPECT_EQ(table->Find("x")->Doubles()[last], n);
  EXPECT_EQ(table->Find("y")->Doubles()[last], 10.0 * n);
  EXPECT_EQ(table->Find("z")->Doubles()[last], 100.0 * n);
  EXPECT_EQ(table->Find("ring")->Doubles()[last], 60000.0 + n);
  EXPECT_EQ(table->Find("t")->Doubles()[last], 4e9 + n);
  EXPECT_EQ(table->Find("normal[0]")->Doubles()[last], 0.5);
  EXPECT_EQ(table->Find("normal[1]")->Doubles()[last], -0.5);
  EXPECT_EQ(table->Find("ring")->Type(), ScalarType::kUint16);
}

void ExpectError(const std::string& bytes, const std::string& words) {
  const auto table = ParsePcd(bytes, "scan.pcd");
  ASSERT_FALSE(table) << bytes.substr(0, 200);
  EXPECT_EQ(table.error().code, ErrorCode::kInput);
  EXPECT_NE(table.error().message.find("scan.pcd"), std::string::npos) << table.error().message;
  EXPECT_NE(table.error().message.find(words), std::string::npos) << table.error().message;
}

std::string AsciiFile(const std::string& sizes, const std::string& body) {
  return "VERSION .7\nFIELDS x y z\n" + sizes + "DATA ascii\n" + body;
}

const char* const kSizes = "SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n";

TEST(Pcd, BinaryWithPaddingCountsAndAnyOrderOfFields) {
  ExpectTable(ParsePcd(Header(3, "binary") + BinaryBody(3), "f"), 3);
}

TEST(Pcd, BinaryCompressed) { ExpectTable(ParsePcd(CompressedFile(50), "f"), 50); }

TEST(Pcd, AsciiWithNanAndWindowsLineEnds) {
  const auto table = ParsePcd(AsciiFile(kSizes, "1 2 3\r\nnan nan nan\r\n"), "f");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->Find("z")->Doubles()[0], 3.0);
  EXPECT_TRUE(std::isnan(table->Find("z")->Doubles()[1]));
}

TEST(Pcd, OrganisedCloudsHaveWidthTimesHeightPoints) {
  const std::string sizes = "SIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 2\nPOINTS 4\n";
  const auto table = ParsePcd(AsciiFile(sizes, "1 2 3\n4 5 6\n7 8 9\n1 1 1\n"), "f");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->Rows(), 4u);
}

TEST(Pcd, CloudsWithoutPointsAreValid) {
  for (const char* data : {"ascii", "binary"}) {
    const auto table = ParsePcd(Header(0, data), "f");
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->Rows(), 0u);
  }
  EXPECT_TRUE(ParsePcd(Header(0, "binary_compressed") + std::string(8, '\0'), "f"));
}

TEST(Pcd, TruncationAtAnyByteIsAnError) {
  for (const std::string& file : {Header(3, "binary") + BinaryBody(3), CompressedFile(20)}) {
    for (std::size_t size = 0; size < file.size(); ++size) {
      EXPECT_FALSE(ParsePcd(file.substr(0, size), "f")) << size;
    }
  }
  ExpectError(AsciiFile(kSizes, "1 2 3\n"), "1 of 2 points");
  ExpectError(AsciiFile(kSizes, "1 2 3\n4 5"), "scan.pcd:11");
}

TEST(Pcd, DamagedHeadersAreErrorsThatSayWhatIsWrong) {
  ExpectError("", "DATA");
  ExpectError("garbage\n", "line 1");
  ExpectError(std::string(1000, '\xff'), "line 1");
  ExpectError(AsciiFile("SIZE 4 4\nTYPE F F F\nWIDTH 2\nPOINTS 2\n", ""), "differ in length");
  ExpectError(AsciiFile("SIZE 4 4 3\nTYPE F F F\nWIDTH 2\nPOINTS 2\n", ""), "field z");
  ExpectError(AsciiFile("SIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 0\nWIDTH 2\nPOINTS 2\n", ""), "field z");
  ExpectError(AsciiFile("SIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 3\n", ""), "POINTS 3");
  ExpectError(AsciiFile("SIZE 4 4 4\nTYPE F F F\nWIDTH -2\nPOINTS -2\n", ""), "whole numbers");
  ExpectError(AsciiFile("SIZE 4 4 4\nTYPE F F F\nPOINTS 2\n", ""), "whole numbers");
  ExpectError("FIELDS x\nSIZE 4\nTYPE F\nWIDTH 1\nPOINTS 1\nDATA zip\n", "DATA");
}

TEST(Pcd, HugeCountsInTheHeaderDoNotExhaustMemory) {
  const std::string huge = "SIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 9\nWIDTH 2000000000\nHEIGHT 1\n";
  const std::string head = "FIELDS x y z\n" + huge;
  ExpectError(head + "DATA binary\n1234", "truncated");
  ExpectError(head + "DATA ascii\n", "0 of 2000000000");
  std::string packed = head + "DATA binary_compressed\n";
  Add(packed, std::uint32_t{4});
  Add(packed, std::uint32_t{0xffffffff});
  ExpectError(packed + "1234", "damaged");
  ExpectError("FIELDS x\nSIZE 8\nTYPE F\nWIDTH 99999999999999999\nDATA binary\n", "whole numbers");
}

TEST(Pcd, DamagedCompressedBytesAreAnErrorOrOtherNumbersButNothingWorse) {
  const std::string file = CompressedFile(30);
  const std::size_t body = Header(30, "binary_compressed").size();
  for (std::size_t at = body; at < file.size(); ++at) {
    std::string damaged = file;
    damaged[at] = static_cast<char>(~damaged[at]);
    const auto table = ParsePcd(damaged, "f");
    if (at < body + 8) {
      EXPECT_FALSE(table) << at;
    }
  }
  ExpectError(file.substr(0, body + 8) + std::string(file.size() - body - 8, '\xff'), "damaged");
}

TEST(Pcd, NumbersThatDoNotFitTheirTypeAreErrorsWithTheLine) {
  const std::string head = "FIELDS x ring\nSIZE 4 1\nTYPE F U\nWIDTH 1\nPOINTS 1\nDATA ascii\n";
  ExpectError(head + "1 256\n", "scan.pcd:7");
  ExpectError(head + "1 -1\n", "ring");
  ExpectError(head + "1 nan\n", "ring");
  ExpectError(head + "1 2.5\n", "ring");
  ExpectError(head + "1 two\n", "expected 2 numbers");
}

TEST(Pcd, AMissingFileIsAnError) { EXPECT_FALSE(ReadPcd("/no/such/file.pcd")); }

}  // namespace
}  // namespace covsplat
