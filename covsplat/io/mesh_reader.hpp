// Triangle meshes in the file formats of others.
#pragma once

#include <filesystem>

#include "covsplat/core/result.hpp"
#include "covsplat/core/triangle_mesh.hpp"

namespace covsplat {

/// Whether a name ends like a mesh that ReadMeshFile reads: .ply, .obj, .gltf, .glb or .stl.
bool IsMeshFileName(const std::filesystem::path& path);

/// Whether the format's standard says that y points up, as that of glTF does.
bool IsYUpByStandard(const std::filesystem::path& path);

/// All triangles of a file in its own units and axes, parts placed as its scene places them;
/// polygons become triangles. A file without triangles, or with a corner that is not finite, is an
/// error.
Result<TriangleMesh> ReadMeshFile(const std::filesystem::path& path);

}  // namespace covsplat
