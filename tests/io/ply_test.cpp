#include "covsplat/io/ply.hpp"

#include <algorithm>
#include <cmath>

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

PointTable MixedTable() {
  PointTable table;
  table.comments = {"made by hand", ""};
  table.columns = {{"x", std::vector<float>{1.0f, std::nanf(""), 1e-30f}},
                   {"stamp", std::vector<double>{1.1, 2.2, 1e300}},
                   {"ring", std::vector<std::uint16_t>{0, 1, 65535}},
                   {"label", std::vector<std::uint8_t>{0, 128, 255}},
                   {"id", std::vector<std::uint32_t>{0, 1, 4294967295u}},
                   {"delta", std::vector<std::int32_t>{-2147483647, 0, 5}}};
  return table;
}

void ExpectError(const std::string& bytes, const std::string& words) {
  const auto table = ParsePly(bytes, "cloud.ply");
  ASSERT_FALSE(table) << bytes;
  EXPECT_EQ(table.error().code, ErrorCode::kInput);
  EXPECT_NE(table.error().message.find("cloud.ply"), std::string::npos) << table.error().message;
  EXPECT_NE(table.error().message.find(words), std::string::npos) << table.error().message;
}

template <class T>
void AddBigEndian(std::string& bytes, T value) {
  std::string raw(reinterpret_cast<const char*>(&value), sizeof(value));
  std::reverse(raw.begin(), raw.end());
  bytes += raw;
}

std::string Ascii(const std::string& elements, const std::string& body) {
  return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + body;
}

const char* const kVertices =
    "element vertex 4\nproperty float x\nproperty float y\n"
    "property float z\n";
const char* const kFaces =
    "element face 2\nproperty uchar flags\n"
    "property list uchar int vertex_indices\n";
const char* const kCorners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

TEST(Ply, WhatIsWrittenIsReadBackBitByBit) {
  const TemporaryFolder folder;
  const PointTable table = MixedTable();
  ASSERT_TRUE(WritePly(folder.Path() / "t.ply", table));
  const auto read = ReadPly(folder.Path() / "t.ply");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->comments, table.comments);
  ASSERT_EQ(read->columns.size(), table.columns.size());
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    EXPECT_EQ(read->columns[c].name, table.columns[c].name);
    EXPECT_EQ(read->columns[c].Type(), table.columns[c].Type());
    if (c > 0) {
      EXPECT_EQ(read->columns[c].values, table.columns[c].values);
    }
  }
  EXPECT_TRUE(std::isnan(read->columns[0].Doubles()[1]));
}

TEST(Ply, TruncationAtAnyByteIsAnError) {
  const TemporaryFolder folder;
  ASSERT_TRUE(WritePly(folder.Path() / "t.ply", MixedTable()));
  const std::string file = folder.Get("t.ply");
  for (std::size_t size = 0; size < file.size(); ++size) {
    EXPECT_FALSE(ParsePly(file.substr(0, size), "f")) << size;
  }
}

TEST(Ply, BigEndian) {
  std::string file =
      "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty float x\n"
      "property ushort ring\nproperty double stamp\nend_header\n";
  for (int i = 0; i < 2; ++i) {
    AddBigEndian(file, 1.5f + static_cast<float>(i));
    AddBigEndian(file, static_cast<std::uint16_t>(258 + i));
    AddBigEndian(file, -0.25);
  }
  const auto table = ParsePly(file, "f");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->Find("x")->Doubles(), (std::vector<double>{1.5, 2.5}));
  EXPECT_EQ(table->Find("ring")->Doubles(), (std::vector<double>{258, 259}));
  EXPECT_EQ(table->Find("stamp")->Doubles()[1], -0.25);
}

TEST(Ply, AsciiWithOtherElementsBeforeAndAfter) {
  const std::string camera = "obj_info x\nelement camera 1\nproperty list int float pose\n";
  const auto table =
      ParsePly(Ascii(camera + kVertices + kFaces, "3 1 2 3\n" + std::string(kCorners)), "f");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->Find("y")->Doubles(), (std::vector<double>{0, 0, 1, 1}));
}

TEST(Ply, FacesBecomeTriangles) {
  const auto mesh = ParseTriangleMesh(
      Ascii(std::string(kVertices) + kFaces, std::string(kCorners) + "9 3 0 1 2\n9 4 0 1 2 3\n"),
      "f");
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->vertices.size(), 4u);
  EXPECT_EQ(mesh->vertices[2], Eigen::Vector3f(1, 1, 0));
  using Triangle = Eigen::Vector3i;
  EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}}));
}

TEST(Ply, DamagedFacesAreErrors) {
  const auto error = [](const std::string& faces) {
    const auto mesh =
        ParseTriangleMesh(Ascii(std::string(kVertices) + kFaces, kCorners + faces), "m.ply");
    return mesh ? std::string() : mesh.error().message;
  };
  EXPECT_NE(error("9 3 0 1 4\n9 3 0 1 2\n").find("no vertex 4"), std::string::npos);
  EXPECT_NE(error("9 3 0 1 -1\n9 3 0 1 2\n").find("m.ply:15"), std::string::npos);
  EXPECT_NE(error("9 3 0 1\n9 3 0 1 2\n").find("ends after 2"), std::string::npos);
  EXPECT_NE(error("9 3 0 1 2 3\n9 3 0 1 2\n").find("more numbers"), std::string::npos);
  EXPECT_NE(error("9 -3 0 1 2\n9 3 0 1 2\n").find("no length"), std::string::npos);
  EXPECT_NE(error("9 3 0 1 2\n").find("before the rows"), std::string::npos);
  EXPECT_FALSE(ParseTriangleMesh(Ascii(kVertices, kCorners), "m.ply"));
}

TEST(Ply, BinaryFacesAreReadAndTheirTruncationIsAnError) {
  std::string file =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_index\nend_header\n";
  file.append(36, '\0');
  file += '\3';
  for (const char index : {'\0', '\1', '\2'}) file += index + std::string(3, '\0');
  const auto mesh = ParseTriangleMesh(file, "f");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 1u);
  for (std::size_t size = 0; size < file.size(); ++size) {
    EXPECT_FALSE(ParseTriangleMesh(file.substr(0, size), "f")) << size;
  }
}

TEST(Ply, AMeshIsReadAsItWasWritten) {
  const TemporaryFolder folder;
  const std::vector<Eigen::Vector3i> triangles = {{0, 1, 2}, {2, 1, 300}};
  PointTable vertices;
  for (const char* name : {"x", "y", "z", "error_m"}) {
    std::vector<float> values(301);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = 0.25f * static_cast<float>(i);
    vertices.columns.push_back({name, std::move(values)});
  }
  ASSERT_TRUE(WritePlyMesh(folder.Path() / "m.ply", vertices, triangles));
  const auto mesh = ReadTriangleMesh(folder.Path() / "m.ply");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles, triangles);
  ASSERT_EQ(mesh->vertices.size(), 301u);
  EXPECT_EQ(mesh->vertices[300], Eigen::Vector3f(75, 75, 75));
  const auto table = ReadPly(folder.Path() / "m.ply");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_NE(table->Find("error_m"), nullptr);
}

TEST(Ply, DamagedHeadersAreErrorsWithTheLine) {
  ExpectError("", "first line");
  ExpectError("plyx\n", "first line");
  ExpectError("ply\nformat ascii 1.0\nelement vertex 1\n", "end_header");
  ExpectError("ply\nformat ascii 2.0\nend_header\n", "cloud.ply:2");
  ExpectError("ply\nelement vertex 0\nend_header\n", "format");
  ExpectError(Ascii("property float x\n", ""), "cloud.ply:3");
  ExpectError(Ascii("element vertex many\n", ""), "cloud.ply:3");
  ExpectError(Ascii("element vertex -1\n", ""), "cloud.ply:3");
  ExpectError(Ascii("element vertex 1\nproperty quad x\n", ""), "cloud.ply:4");
  ExpectError(Ascii("hello\n", ""), "cloud.ply:3");
  ExpectError(Ascii("element face 0\nproperty float x\n", ""), "no element \"vertex\"");
}

TEST(Ply, HugeCountsInTheHeaderDoNotExhaustMemory) {
  const std::string elements = "element vertex 9000000000000000000\nproperty double x\n";
  ExpectError(Ascii(elements, "1\n"), "before the rows");
  ExpectError("ply\nformat binary_little_endian 1.0\n" + elements + "end_header\n12345678",
              "truncated");
}

TEST(Ply, DamagedNumbersAreErrorsWithTheLine) {
  const std::string elements = "element vertex 2\nproperty float x\nproperty uchar ring\n";
  ExpectError(Ascii(elements, "1 2\n\nx 3\n"), "cloud.ply:9");
  ExpectError(Ascii(elements, "1 2\n3 300\n"), "ring");
  ExpectError(Ascii(elements, "1 2\n3\n"), "ring");
  ExpectError(Ascii(elements, "1 2 3\n4 5 6\n"), "more numbers");
}

}  // namespace
}  // namespace covsplat
