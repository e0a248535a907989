#include "covsplat/io/ply.hpp"

#include <array>

#include "covsplat/core/check.hpp"
#include "covsplat/io/output_file.hpp"
#include "covsplat/io/ply_body.hpp"
#include "covsplat/io/ply_header.hpp"
#include "covsplat/io/text.hpp"

namespace covsplat {
namespace {

tl::unexpected<Error> NoElement(const std::string& file, std::string_view name) {
  return Fail(ErrorCode::kInput, "{}: has no element \"{}\"", file, name);
}

std::vector<float> Floats(const PointColumn& column) {
  const std::vector<double> doubles = column.Doubles();
  return {doubles.begin(), doubles.end()};
}

Result<std::vector<Eigen::Vector3f>> Positions(const PointTable& table, const std::string& file) {
  std::array<std::vector<float>, 3> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const char name = "xyz"[axis];
    const PointColumn* column = table.Find(std::string_view(&name, 1));
    if (column == nullptr) {
      return Fail(ErrorCode::kInput, "{}: its vertices have no property {}", file, name);
    }
    axes[axis] = Floats(*column);
  }
  std::vector<Eigen::Vector3f> positions;
  for (std::size_t i = 0; i < axes[0].size(); ++i) {
    positions.emplace_back(axes[0][i], axes[1][i], axes[2][i]);
  }
  return positions;
}

std::string HeaderText(const PointTable& vertices, std::size_t rows) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : vertices.comments) {
    COVSPLAT_CHECK(comment.find('\n') == std::string::npos);
    text += "comment " + comment + "\n";
  }
  text += fmt::format("element vertex {}\n", rows);
  for (const PointColumn& column : vertices.columns) {
    COVSPLAT_CHECK(column.Size() == vertices.Rows() && !PlyTypeName(column.Type()).empty());
    text += fmt::format("property {} {}\n", PlyTypeName(column.Type()), column.name);
  }
  return text;
}

void AppendRows(const PointTable& vertices, std::string& bytes) {
  std::size_t stride = 0;
  for (const PointColumn& column : vertices.columns) stride += SizeOf(column.Type());
  std::size_t first = bytes.size();
  bytes.resize(first + stride * vertices.Rows());
  for (const PointColumn& column : vertices.columns) {
    CopyBytes(column.values, bytes.data() + first, stride);
    first += SizeOf(column.Type());
  }
}

void AddColumns(const std::array<const char*, 3>& names,
                const std::vector<Eigen::Vector3f>& vectors,
                PointTable& table) {
  for (std::size_t axis = 0; axis < names.size(); ++axis) {
    std::vector<float> values;
    values.reserve(vectors.size());
    for (const Eigen::Vector3f& v : vectors) values.push_back(v[static_cast<int>(axis)]);
    table.columns.push_back({names[axis], std::move(values)});
  }
}

}  // namespace

Result<PointTable> ReadPly(const std::filesystem::path& path) {
  const Result<std::string> bytes = ReadFile(path);
  if (!bytes) return Forward(bytes);
  return ParsePly(*bytes, path.string());
}

Result<PointTable> ParsePly(std::string_view bytes, const std::string& file) {
  const Result<PlyHeader> header = ParsePlyHeader(bytes, file);
  if (!header) return Forward(header);
  PlyBody body(bytes, *header, file);
  for (const PlyElement& element : header->elements) {
    Result<std::vector<PointColumn>> columns = body.ReadColumns(element);
    if (!columns) return Forward(columns);
    if (element.name == "vertex") return PointTable{std::move(*columns), header->comments};
  }
  return NoElement(file, "vertex");
}

Result<TriangleMesh> ReadTriangleMesh(const std::filesystem::path& path) {
  const Result<std::string> bytes = ReadFile(path);
  if (!bytes) return Forward(bytes);
  return ParseTriangleMesh(*bytes, path.string());
}

Result<TriangleMesh> ParseTriangleMesh(std::string_view bytes, const std::string& file) {
  const Result<PlyHeader> header = ParsePlyHeader(bytes, file);
  if (!header) return Forward(header);
  PlyBody body(bytes, *header, file);
  TriangleMesh mesh;
  for (const PlyElement& element : header->elements) {
    if (element.name == "face") {
      auto triangles = body.ReadTriangles(element, mesh.vertices.size());
      if (!triangles) return Forward(triangles);
      mesh.triangles = std::move(*triangles);
      return mesh;
    }
    Result<std::vector<PointColumn>> columns = body.ReadColumns(element);
    if (!columns) return Forward(columns);
    if (element.name != "vertex") continue;
    auto positions = Positions({std::move(*columns), {}}, file);
    if (!positions) return Forward(positions);
    mesh.vertices = std::move(*positions);
  }
  return NoElement(file, "face");
}

Result<void> WritePly(const std::filesystem::path& path, const PointTable& vertices) {
  std::string bytes = HeaderText(vertices, vertices.Rows()) + "end_header\n";
  AppendRows(vertices, bytes);
  return WriteFileAtomically(path, bytes);
}

Result<void> WritePly(const std::filesystem::path& path,
                      std::size_t rows,
                      const std::function<PointTable(std::size_t, std::size_t)>& part) {
  constexpr std::size_t kRowsAtOnce = 65536;
  return WriteFileAtomically(path, [&](AppendFile& file) {
    Result<void> written = file.Append(HeaderText(part(0, 0), rows) + "end_header\n");
    for (std::size_t begin = 0; written && begin < rows; begin += kRowsAtOnce) {
      std::string bytes;
      AppendRows(part(begin, std::min(begin + kRowsAtOnce, rows)), bytes);
      written = file.Append(bytes);
    }
    return written;
  });
}

Result<void> WritePlyMesh(const std::filesystem::path& path,
                          const PointTable& vertices,
                          std::span<const Eigen::Vector3i> triangles) {
  std::string bytes = HeaderText(vertices, vertices.Rows());
  bytes += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                       triangles.size());
  AppendRows(vertices, bytes);
  bytes.reserve(bytes.size() + 13 * triangles.size());
  for (const Eigen::Vector3i& triangle : triangles) {
    bytes.push_back(3);
    for (const std::int32_t corner : triangle) {
      for (int shift = 0; shift < 32; shift += 8)
        bytes.push_back(static_cast<char>(corner >> shift));
    }
  }
  return WriteFileAtomically(path, bytes);
}

Result<void> WriteTriangleMesh(const std::filesystem::path& path, const TriangleMesh& mesh) {
  COVSPLAT_CHECK(mesh.normals.empty() || mesh.normals.size() == mesh.vertices.size());
  PointTable vertices;
  AddColumns({"x", "y", "z"}, mesh.vertices, vertices);
  if (!mesh.normals.empty()) AddColumns({"nx", "ny", "nz"}, mesh.normals, vertices);
  return WritePlyMesh(path, vertices, mesh.triangles);
}

}  // namespace covsplat
