// Triangle meshes as files.
#pragma once

#include <filesystem>

#include "covsplat/core/result.hpp"
#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat {

/// Formats by the name's end: .ply (binary), .obj (text), .glb (binary glTF 2.0; z up becomes y up
/// by the node's rotation, as the format demands).
enum class MeshFormat { kPly, kObj, kGlb };

/// The error lists what there is.
Result<MeshFormat> MeshFormatOf(const std::filesystem::path& path);

/// Writes vertices, normals where there are any, and triangles, at once.
Result<void> WriteMesh(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace covsplat
