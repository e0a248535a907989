#include "covsplat/io/mesh_reader.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <system_error>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "covsplat/io/ply.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 5> kExtensions = {".ply", ".obj", ".gltf", ".glb", ".stl"};

std::string ExtensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

void Append(const aiMesh& part, TriangleMesh& mesh) {
  const auto first = static_cast<int>(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& at = part.mVertices[i];
    mesh.vertices.emplace_back(at.x, at.y, at.z);
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines
    mesh.triangles.emplace_back(first + static_cast<int>(face.mIndices[0]),
                                first + static_cast<int>(face.mIndices[1]),
                                first + static_cast<int>(face.mIndices[2]));
  }
}

Result<TriangleMesh> ReadWithAssimp(const fs::path& path) {
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (scene == nullptr) {
    return Fail(
        ErrorCode::kInput, "{}: cannot be read: {}", path.string(), importer.GetErrorString());
  }
  TriangleMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) Append(*scene->mMeshes[i], mesh);
  return mesh;
}

}  // namespace

bool IsMeshFileName(const fs::path& path) {
  const std::string extension = ExtensionOf(path);
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

bool IsYUpByStandard(const fs::path& path) {
  const std::string extension = ExtensionOf(path);
  return extension == ".gltf" || extension == ".glb";
}

Result<TriangleMesh> ReadMeshFile(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return Fail(ErrorCode::kInput, "{}: does not exist", path.string());
  }
  if (!IsMeshFileName(path)) {
    return Fail(ErrorCode::kInput,
                "{}: is no mesh file that can be read; known: {}",
                path.string(),
                fmt::join(kExtensions, ", "));
  }
  Result<TriangleMesh> mesh =
      ExtensionOf(path) == ".ply" ? ReadTriangleMesh(path) : ReadWithAssimp(path);
  if (!mesh) return mesh;
  if (mesh->triangles.empty()) {
    return Fail(ErrorCode::kInput,
                "{}: has {} vertices but no triangles; a surface is needed, not points",
                path.string(),
                mesh->vertices.size());
  }
  const auto broken = [](const Eigen::Vector3f& vertex) { return !vertex.allFinite(); };
  if (std::any_of(mesh->vertices.begin(), mesh->vertices.end(), broken)) {
    return Fail(ErrorCode::kInput, "{}: has a vertex that is not finite", path.string());
  }
  return mesh;
}

}  // namespace covsplat
