#include "covsplat/mapping/map_ply.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "covsplat/io/ply.hpp"

namespace covsplat {
namespace {

constexpr float kShOfColor = 0.28209479177387814f;  // band 0 of the spherical harmonics

// Rows of the map that are to be written at once.
struct Part {
  const SavedMap& map;
  std::size_t begin;
  std::size_t end;

  std::vector<float> Of(Parameter parameter) const {
    const float* column = map.gaussians.Column(parameter);
    return {column + begin, column + end};
  }
  template <class T>
  std::vector<float> Of(const std::vector<T>& values) const {
    return {values.begin() + static_cast<std::ptrdiff_t>(begin),
            values.begin() + static_cast<std::ptrdiff_t>(end)};
  }
};

void AddNormals(const Part& part, PointTable& table) {
  constexpr std::array<const char*, 3> kNormal = {"nx", "ny", "nz"};
  constexpr std::array<const char*, 3> kColor = {"f_dc_0", "f_dc_1", "f_dc_2"};
  std::array<std::vector<float>, 3> normal, color;
  for (std::size_t i = part.begin; i < part.end; ++i) {
    const Eigen::Vector3f n = NormalOf(part.map.gaussians, i);
    for (std::size_t k = 0; k < 3; ++k) {
      const float component = n[static_cast<Eigen::Index>(k)];
      normal[k].push_back(component);
      color[k].push_back(0.5f * component / kShOfColor);  // (0.5 + 0.5 n - 0.5) / SH
    }
  }
  for (std::size_t k = 0; k < 3; ++k) table.columns.push_back({kNormal[k], std::move(normal[k])});
  for (std::size_t k = 0; k < 3; ++k) table.columns.push_back({kColor[k], std::move(color[k])});
}

PointTable TableOf(const Part& part) {
  PointTable table;
  table.comments = {"SplatRenderMode: 2dgs", "Vertical axis: z"};
  const auto add = [&](const char* name, std::vector<float> values) {
    table.columns.push_back({name, std::move(values)});
  };
  add("x", part.Of(kMeanX));
  add("y", part.Of(kMeanY));
  add("z", part.Of(kMeanZ));
  AddNormals(part, table);
  add("opacity", part.Of(kOpacityLogit));
  add("scale_0", part.Of(kLogScaleU));
  add("scale_1", part.Of(kLogScaleV));
  add("scale_2", std::vector<float>(part.end - part.begin, std::log(kThicknessM)));
  add("rot_0", part.Of(kQuatW));
  add("rot_1", part.Of(kQuatX));
  add("rot_2", part.Of(kQuatY));
  add("rot_3", part.Of(kQuatZ));
  add("confidence", part.Of(part.map.confidence));
  add("control_score", part.Of(part.map.control_score));
  add("intensity", part.Of(part.map.intensity));
  add("keyframe", part.Of(part.map.keyframe));
  add("last_seen", part.Of(part.map.last_seen));
  return table;
}

/// The values of a column, or as many times `missing`.
template <class T>
std::vector<T> Values(const PointTable& table, std::string_view name, T missing) {
  const PointColumn* column = table.Find(name);
  if (column == nullptr) return std::vector<T>(table.Rows(), missing);
  std::vector<T> values;
  values.reserve(column->Size());
  for (const double value : column->Doubles()) {
    const bool fits = std::is_floating_point_v<T> || std::abs(value) < 1e9;
    values.push_back(fits ? static_cast<T>(value) : missing);
  }
  return values;
}

}  // namespace

Result<void> WriteMapPly(const std::filesystem::path& path, const SavedMap& map) {
  return WritePly(path, map.Size(), [&](std::size_t begin, std::size_t end) {
    return TableOf({map, begin, end});
  });
}

Result<SavedMap> ParseMapPly(std::string_view bytes, const std::string& file) {
  const Result<PointTable> table = ParsePly(bytes, file);
  if (!table) return Forward(table);
  constexpr std::array<const char*, 10> kNeeded = {
      "x", "y", "z", "rot_0", "rot_1", "rot_2", "rot_3", "scale_0", "scale_1", "opacity"};
  std::array<std::vector<float>, kNeeded.size()> column;
  for (std::size_t k = 0; k < kNeeded.size(); ++k) {
    if (table->Find(kNeeded[k]) == nullptr) {
      return Fail(ErrorCode::kInput,
                  "{}: has no property {}: not a map of Gaussians as `covsplat run` writes it",
                  file,
                  kNeeded[k]);
    }
    column[k] = Values<float>(*table, kNeeded[k], 0.0f);
  }
  const auto scale_2 = Values<float>(*table, "scale_2", -std::numeric_limits<float>::infinity());
  SavedMap map;
  map.Resize(table->Rows());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    SetRow(map,
           i,
           {column[0][i], column[1][i], column[2][i]},
           {column[3][i], column[4][i], column[5][i], column[6][i]},
           {column[7][i], column[8][i], scale_2[i]},
           column[9][i]);
  }
  map.confidence = Values<float>(*table, "confidence", 0.0f);
  map.control_score = Values<float>(*table, "control_score", -1.0f);
  map.intensity = Values<float>(*table, "intensity", 0.0f);
  map.keyframe = Values<int>(*table, "keyframe", -1);
  map.last_seen = Values<int>(*table, "last_seen", -1);
  return map;
}

}  // namespace covsplat
