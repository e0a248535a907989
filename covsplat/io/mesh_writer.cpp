#include "covsplat/io/mesh_writer.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <nlohmann/json.hpp>

#include "covsplat/core/check.hpp"
#include "covsplat/io/output_file.hpp"
#include "covsplat/io/ply.hpp"

namespace covsplat {
namespace {

static_assert(std::endian::native == std::endian::little, "meshes are written as they lie");

template <class T>
void AppendRaw(const T* values, std::size_t count, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

std::string ObjText(const TriangleMesh& mesh) {
  std::string text;
  auto out = std::back_inserter(text);
  for (const Eigen::Vector3f& v : mesh.vertices) {
    fmt::format_to(out, "v {} {} {}\n", v.x(), v.y(), v.z());
  }
  for (const Eigen::Vector3f& n : mesh.normals) {
    fmt::format_to(out, "vn {:.4f} {:.4f} {:.4f}\n", n.x(), n.y(), n.z());
  }
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Eigen::Vector3i c = t.array() + 1;
    if (mesh.normals.empty()) {
      fmt::format_to(out, "f {} {} {}\n", c[0], c[1], c[2]);
    } else {
      fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2}\n", c[0], c[1], c[2]);
    }
  }
  return text;
}

using Json = nlohmann::ordered_json;

/// The buffer of a glTF asset and the JSON that says what lies where.
class GltfBuffer {
 public:
  /// Appends an accessor over packed triples of float32; `target` as in the specification.
  int AddVectors(const std::vector<Eigen::Vector3f>& values, bool with_bounds) {
    Json accessor = {{"bufferView", AddView(3 * sizeof(float) * values.size(), kVertices)},
                     {"componentType", kFloat},
                     {"count", values.size()},
                     {"type", "VEC3"}};
    Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max());
    Eigen::Vector3f high = -low;
    for (const Eigen::Vector3f& v : values) {
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
      AppendRaw(v.data(), 3, bytes_);
    }
    if (with_bounds) {  // demanded of positions
      accessor["min"] = {low.x(), low.y(), low.z()};
      accessor["max"] = {high.x(), high.y(), high.z()};
    }
    return Add(std::move(accessor));
  }

  int AddIndices(const std::vector<Eigen::Vector3i>& triangles) {
    Json accessor = {{"bufferView", AddView(3 * sizeof(int) * triangles.size(), kIndices)},
                     {"componentType", kUnsignedInt},
                     {"count", 3 * triangles.size()},
                     {"type", "SCALAR"}};
    for (const Eigen::Vector3i& t : triangles) AppendRaw(t.data(), 3, bytes_);
    return Add(std::move(accessor));
  }

  const Json& Accessors() const { return accessors_; }
  const Json& Views() const { return views_; }
  const std::string& Bytes() const { return bytes_; }

 private:
  static constexpr int kVertices = 34962;  // ARRAY_BUFFER
  static constexpr int kIndices = 34963;   // ELEMENT_ARRAY_BUFFER
  static constexpr int kFloat = 5126;
  static constexpr int kUnsignedInt = 5125;

  std::size_t AddView(std::size_t length, int target) {
    views_.push_back(
        {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", length}, {"target", target}});
    return views_.size() - 1;
  }
  int Add(Json accessor) {
    accessors_.push_back(std::move(accessor));
    return static_cast<int>(accessors_.size()) - 1;
  }

  Json accessors_ = Json::array();
  Json views_ = Json::array();
  std::string bytes_;
};

void AppendChunk(const char (&type)[5], std::string data, char padding, std::string& glb) {
  data.resize((data.size() + 3) / 4 * 4, padding);
  const auto length = static_cast<std::uint32_t>(data.size());
  AppendRaw(&length, 1, glb);
  glb.append(type, 4);
  glb += data;
}

Result<std::string> GlbBytes(const TriangleMesh& mesh, const std::string& file) {
  GltfBuffer buffer;
  Json attributes = {{"POSITION", buffer.AddVectors(mesh.vertices, true)}};
  if (!mesh.normals.empty()) attributes["NORMAL"] = buffer.AddVectors(mesh.normals, false);
  const int indices = buffer.AddIndices(mesh.triangles);
  const double half = std::sqrt(0.5);
  const Json gltf = {
      {"asset", {{"version", "2.0"}, {"generator", "covsplat"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}, {"rotation", {-half, 0.0, 0.0, half}}}}},
      {"meshes",
       {{{"primitives", {{{"attributes", attributes}, {"indices", indices}, {"material", 0}}}}}}},
      {"materials",
       {{{"doubleSided", true},
         {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 0.9}}}}}},
      {"accessors", buffer.Accessors()},
      {"bufferViews", buffer.Views()},
      {"buffers", {{{"byteLength", buffer.Bytes().size()}}}}};
  std::string chunks;
  AppendChunk("JSON", gltf.dump(), ' ', chunks);
  AppendChunk({'B', 'I', 'N', '\0', '\0'}, buffer.Bytes(), '\0', chunks);
  if (chunks.size() > std::numeric_limits<std::uint32_t>::max() - 12u) {
    return Fail(ErrorCode::kOutput,
                "{}: a GLB file holds at most 4 GB; choose .ply or larger voxels",
                file);
  }
  const std::uint32_t header[] = {2u, static_cast<std::uint32_t>(12 + chunks.size())};
  std::string glb = "glTF";
  AppendRaw(header, 2, glb);
  return glb + chunks;
}

}  // namespace

Result<MeshFormat> MeshFormatOf(const std::filesystem::path& path) {
  std::string end = path.extension().string();
  std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  if (end == ".ply") return MeshFormat::kPly;
  if (end == ".obj") return MeshFormat::kObj;
  if (end == ".glb") return MeshFormat::kGlb;
  return Fail(
      ErrorCode::kUsage,
      "{}: cannot tell the format of a mesh by \"{}\"; end the name with .ply, .obj or .glb",
      path.string(),
      end);
}

Result<void> WriteMesh(const std::filesystem::path& path, const TriangleMesh& mesh) {
  COVSPLAT_CHECK(mesh.normals.empty() || mesh.normals.size() == mesh.vertices.size());
  const Result<MeshFormat> format = MeshFormatOf(path);
  if (!format) return Forward(format);
  if (*format == MeshFormat::kPly) return WriteTriangleMesh(path, mesh);
  if (*format == MeshFormat::kObj) return WriteFileAtomically(path, ObjText(mesh));
  const Result<std::string> glb = GlbBytes(mesh, path.string());
  return glb ? WriteFileAtomically(path, *glb) : Forward(glb);
}

}  // namespace covsplat
