// PLY files: named columns of vertices, and triangle meshes.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "covsplat/core/result.hpp"
#include "covsplat/core/triangle_mesh.hpp"
#include "covsplat/io/point_table.hpp"

namespace covsplat {

/// The vertices of a PLY file, ascii or binary of either byte order, with all their scalar
/// properties and the comments of the header. Other elements are passed over.
Result<PointTable> ReadPly(const std::filesystem::path& path);
/// The same from bytes in memory; `file` is for messages.
Result<PointTable> ParsePly(std::string_view bytes, const std::string& file);

/// The vertices and faces of a PLY file; faces of more than three corners become fans.
Result<TriangleMesh> ReadTriangleMesh(const std::filesystem::path& path);
/// The same from bytes in memory; `file` is for messages.
Result<TriangleMesh> ParseTriangleMesh(std::string_view bytes, const std::string& file);

/// Writes the vertices as binary_little_endian, at once. Comments must be single lines; columns of
/// 64-bit integers do not exist in PLY.
Result<void> WritePly(const std::filesystem::path& path, const PointTable& vertices);

/// The same of a table too large to be there at once: `part(begin, end)` makes some of its rows.
Result<void> WritePly(const std::filesystem::path& path,
                      std::size_t rows,
                      const std::function<PointTable(std::size_t, std::size_t)>& part);

/// The same with faces (int vertex_indices).
Result<void> WritePlyMesh(const std::filesystem::path& path,
                          const PointTable& vertices,
                          std::span<const Eigen::Vector3i> triangles);

/// A mesh: positions, normals where there are any, and triangles.
Result<void> WriteTriangleMesh(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace covsplat
