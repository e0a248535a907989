#include "covsplat/mapping/map_file.hpp"

#include <array>
#include <cmath>

#include "covsplat/io/ply.hpp"

namespace covsplat {
namespace {

constexpr float kThicknessM = 1e-4f;
constexpr float kShOfColor = 0.28209479177387814f;  // band 0 of the spherical harmonics

/// Properties that are columns of the table as they are.
constexpr std::array<std::pair<Parameter, const char*>, kParameterCount> kProperties = {{
    {kMeanX, "x"},
    {kMeanY, "y"},
    {kMeanZ, "z"},
    {kQuatW, "rot_0"},
    {kQuatX, "rot_1"},
    {kQuatY, "rot_2"},
    {kQuatZ, "rot_3"},
    {kLogScaleU, "scale_0"},
    {kLogScaleV, "scale_1"},
    {kOpacityLogit, "opacity"},
}};

std::vector<float> ColumnOf(const SavedMap& map, Parameter parameter) {
  const float* column = map.gaussians.Column(parameter);
  return {column, column + map.Size()};
}

void AddNormals(const SavedMap& map, PointTable& table) {
  constexpr std::array<const char*, 3> kNormal = {"nx", "ny", "nz"};
  constexpr std::array<const char*, 3> kColor = {"f_dc_0", "f_dc_1", "f_dc_2"};
  std::array<std::vector<float>, 3> normal, color;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    const Eigen::Vector3f n = NormalOf(map.gaussians, i);
    for (std::size_t k = 0; k < 3; ++k) {
      const float component = n[static_cast<Eigen::Index>(k)];
      normal[k].push_back(component);
      color[k].push_back(0.5f * component / kShOfColor);  // (0.5 + 0.5 n - 0.5) / SH
    }
  }
  for (std::size_t k = 0; k < 3; ++k) table.columns.push_back({kNormal[k], std::move(normal[k])});
  for (std::size_t k = 0; k < 3; ++k) table.columns.push_back({kColor[k], std::move(color[k])});
}

PointTable TableOf(const SavedMap& map) {
  PointTable table;
  table.comments = {"SplatRenderMode: 2dgs", "Vertical axis: z"};
  const auto add = [&](const char* name, std::vector<float> values) {
    table.columns.push_back({name, std::move(values)});
  };
  const auto floats = [](const std::vector<int>& v) {
    return std::vector<float>(v.begin(), v.end());
  };
  add("x", ColumnOf(map, kMeanX));
  add("y", ColumnOf(map, kMeanY));
  add("z", ColumnOf(map, kMeanZ));
  AddNormals(map, table);
  add("opacity", ColumnOf(map, kOpacityLogit));
  add("scale_0", ColumnOf(map, kLogScaleU));
  add("scale_1", ColumnOf(map, kLogScaleV));
  add("scale_2", std::vector<float>(map.Size(), std::log(kThicknessM)));
  add("rot_0", ColumnOf(map, kQuatW));
  add("rot_1", ColumnOf(map, kQuatX));
  add("rot_2", ColumnOf(map, kQuatY));
  add("rot_3", ColumnOf(map, kQuatZ));
  add("confidence", map.confidence);
  add("control_score", map.control_score);
  add("intensity", map.intensity);
  add("keyframe", floats(map.keyframe));
  add("last_seen", floats(map.last_seen));
  return table;
}

/// The values of a column, or as many times `missing`.
template <class T>
std::vector<T> Values(const PointTable& table, std::string_view name, T missing) {
  const PointColumn* column = table.Find(name);
  if (column == nullptr) return std::vector<T>(table.Rows(), missing);
  std::vector<T> values;
  for (const double value : column->Doubles()) values.push_back(static_cast<T>(value));
  return values;
}

}  // namespace

Eigen::Vector3f NormalOf(const GaussianColumns<float>& gaussians, std::size_t row) {
  return RotationOf(gaussians, row) * Eigen::Vector3f::UnitZ();
}

SavedMap FlattenMap(const GaussianMap& map) {
  const GaussianColumns<float>& from = map.Engine().Gaussians();
  SavedMap saved;
  saved.gaussians.Resize(map.Size());
  std::size_t row = 0;
  for (const AnchorRange& range : map.Engine().Ranges()) {
    const SE3& T_map_anchor = map.KeyframePose(range.anchor);
    for (std::size_t i = range.begin; i < range.end; ++i, ++row) {
      const Eigen::Vector3f mean = (T_map_anchor * MeanOf(from, i).cast<double>()).cast<float>();
      const Eigen::Quaternionf q =
          (T_map_anchor.Rotation() * RotationOf(from, i).cast<double>()).normalized().cast<float>();
      const std::array<float, kParameterCount> values = {mean.x(),
                                                         mean.y(),
                                                         mean.z(),
                                                         q.w(),
                                                         q.x(),
                                                         q.y(),
                                                         q.z(),
                                                         from.Column(kLogScaleU)[i],
                                                         from.Column(kLogScaleV)[i],
                                                         from.Column(kOpacityLogit)[i]};
      for (int p = 0; p < kParameterCount; ++p) {
        saved.gaussians.Column(p)[row] = values[static_cast<std::size_t>(p)];
      }
      const float score = map.Signals().control_score[i];
      saved.confidence.push_back(map.Signals().confidence[i]);
      saved.control_score.push_back(std::isnan(score) ? -1.0f : score);
      saved.intensity.push_back(map.Signals().intensity[i]);
      saved.keyframe.push_back(range.anchor);
      saved.last_seen.push_back(map.Signals().last_seen[i]);
    }
  }
  return saved;
}

Result<void> WriteMapPly(const std::filesystem::path& path, const SavedMap& map) {
  return WritePly(path, TableOf(map));
}

Result<SavedMap> ReadMapPly(const std::filesystem::path& path) {
  const Result<PointTable> table = ReadPly(path);
  if (!table) return Forward(table);
  SavedMap map;
  map.gaussians.Resize(table->Rows());
  for (const auto& [parameter, name] : kProperties) {
    const PointColumn* column = table->Find(name);
    if (column == nullptr) {
      return Fail(ErrorCode::kInput,
                  "{}: has no property {}: not a map of Gaussians as `covsplat run` writes it",
                  path.string(),
                  name);
    }
    const std::vector<double> values = column->Doubles();
    for (std::size_t i = 0; i < values.size(); ++i) {
      map.gaussians.Column(parameter)[i] = static_cast<float>(values[i]);
    }
  }
  map.confidence = Values<float>(*table, "confidence", 0.0f);
  map.control_score = Values<float>(*table, "control_score", 0.0f);
  map.intensity = Values<float>(*table, "intensity", 0.0f);
  map.keyframe = Values<int>(*table, "keyframe", -1);
  map.last_seen = Values<int>(*table, "last_seen", -1);
  return map;
}

}  // namespace covsplat
