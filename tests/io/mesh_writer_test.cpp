#include "covsplat/io/mesh_writer.hpp"

#include <cstring>

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "covsplat/io/pcd.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

TriangleMesh Tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices = {
      {0.0f, 0.0f, 0.0f}, {1.5f, 0.0f, 0.0f}, {0.0f, 2.0f, 0.0f}, {0.0f, 0.0f, -3.25f}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  for (const Eigen::Vector3f& v : mesh.vertices) {
    mesh.normals.push_back((v - Eigen::Vector3f(0.4f, 0.5f, -0.8f)).normalized());
  }
  return mesh;
}

template <class T>
T At(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

TEST(MeshFile, PlyReadsBackWithNormals) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = Tetrahedron();
  ASSERT_TRUE(WriteMesh(folder.Path() / "a.ply", mesh));
  const TriangleMesh read = ReadTriangleMesh(folder.Path() / "a.ply").value();
  EXPECT_EQ(read.vertices, mesh.vertices);
  EXPECT_EQ(read.triangles, mesh.triangles);
  const PointTable table = ReadPly(folder.Path() / "a.ply").value();
  ASSERT_NE(table.Find("nz"), nullptr);
  EXPECT_FLOAT_EQ(static_cast<float>(table.Find("nz")->Doubles()[3]), mesh.normals[3].z());
}

TEST(MeshFile, ObjNamesVerticesFromOneWithTheirNormals) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = Tetrahedron();
  ASSERT_TRUE(WriteMesh(folder.Path() / "a.OBJ", mesh));
  const std::string text = folder.Get("a.OBJ");
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::string> faces;
  LineReader lines(text);
  while (lines.Next()) {
    const auto words = SplitWords(lines.Line());
    if (words[0] == "v") {
      vertices.emplace_back(*ParseDouble(words[1]), *ParseDouble(words[2]), *ParseDouble(words[3]));
    }
    if (words[0] == "f") faces.emplace_back(lines.Line());
  }
  EXPECT_EQ(vertices, mesh.vertices);
  ASSERT_EQ(faces.size(), 4u);
  EXPECT_EQ(faces[3], "f 2//2 4//4 3//3");
}

TEST(MeshFile, GlbIsWhatTheSpecificationSays) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = Tetrahedron();
  ASSERT_TRUE(WriteMesh(folder.Path() / "a.glb", mesh));
  const std::string bytes = folder.Get("a.glb");
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(At<std::uint32_t>(bytes, 4), 2u);
  EXPECT_EQ(At<std::uint32_t>(bytes, 8), bytes.size());
  const std::size_t json_size = At<std::uint32_t>(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(json_size % 4, 0u);
  const auto gltf = nlohmann::json::parse(bytes.substr(20, json_size));
  const std::size_t binary = 20 + json_size + 8;
  EXPECT_EQ(bytes.substr(binary - 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(At<std::uint32_t>(bytes, binary - 8) + binary, bytes.size());

  const auto& primitive = gltf["meshes"][0]["primitives"][0];
  const auto start_of = [&](int accessor) {
    const int view = gltf["accessors"][static_cast<std::size_t>(accessor)]["bufferView"];
    return binary +
           gltf["bufferViews"][static_cast<std::size_t>(view)]["byteOffset"].get<std::size_t>();
  };
  const int position = primitive["attributes"]["POSITION"];
  const auto& accessor = gltf["accessors"][static_cast<std::size_t>(position)];
  EXPECT_EQ(accessor["count"], 4);
  EXPECT_EQ(accessor["min"][2], -3.25);
  EXPECT_EQ(accessor["max"][1], 2.0);
  EXPECT_EQ(At<float>(bytes, start_of(position) + 3 * 12 + 8), -3.25f);
  const int normal = primitive["attributes"]["NORMAL"];
  EXPECT_EQ(At<float>(bytes, start_of(normal) + 4), mesh.normals[0].y());
  EXPECT_EQ(At<std::uint32_t>(bytes, start_of(primitive["indices"]) + 4 * 4), 3u);
}

TEST(MeshFile, AnUnknownEndOfTheNameIsAUsageError) {
  const auto written = WriteMesh("mesh.stl", Tetrahedron());
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kUsage);
  EXPECT_NE(written.error().message.find(".glb"), std::string::npos);
}

TEST(Pcd, WhatIsWrittenReadsBack) {
  const TemporaryFolder folder;
  PointTable table;
  table.columns = {{"x", std::vector<float>{1.0f, -2.5f}},
                   {"ring", std::vector<std::uint16_t>{7, 65535}},
                   {"t", std::vector<double>{0.25, 1e9}}};
  ASSERT_TRUE(WritePcd(folder.Path() / "a.pcd", table));
  const PointTable read = ReadPcd(folder.Path() / "a.pcd").value();
  ASSERT_EQ(read.columns.size(), 3u);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(read.columns[c].name, table.columns[c].name);
    EXPECT_EQ(read.columns[c].values, table.columns[c].values);
  }
}

}  // namespace
}  // namespace covsplat
