#include "covsplat/mesh/surfel_map.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
namespace {

/// Row `i` of a table in the map frame becomes row `row` of a table in another frame.
void MoveInto(const SE3& T_anchor_map,
              const GaussianColumns<float>& from,
              std::size_t i,
              GaussianColumns<float>& to,
              std::size_t row) {
  for (int p = 0; p < kParameterCount; ++p) to.Column(p)[row] = from.Column(p)[i];
  const Eigen::Vector3d moved = T_anchor_map * MeanOf(from, i).cast<double>();
  const Eigen::Quaterniond turned =
      T_anchor_map.Rotation() * RotationOf(from, i).cast<double>().normalized();
  WritePose(to, row, moved.cast<float>(), turned.cast<float>());
}

}  // namespace

SurfelDisc DiscOf(const SurfelMap& map, std::size_t i) {
  constexpr double kSigmas = 2.0;
  constexpr double kMaxRadiusM = 5.0;  // maps have none that large
  const GaussianColumns<float>& table = map.gaussians;
  const Eigen::Quaterniond q = RotationOf(table, i).cast<double>();
  const auto radius = [&](Parameter scale) {
    return std::min(kSigmas * std::exp(static_cast<double>(table.Column(scale)[i])), kMaxRadiusM);
  };
  return {MeanOf(table, i).cast<double>(),
          q.normalized().toRotationMatrix(),
          radius(kLogScaleU),
          radius(kLogScaleV)};
}

std::size_t DropBroken(SurfelMap& map) {
  RowMoves sound;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    if (IsSound(map.gaussians, i)) sound.Add(sound.size++, i);
  }
  const std::size_t dropped = map.Size() - sound.size;
  map.gaussians.Move(sound);
  MoveRows(sound, map.keyframe);
  MoveRows(sound, map.confidence);
  MoveRows(sound, map.intensity);
  return dropped;
}

Result<std::unique_ptr<SplatEngine>> MakeMapEngine(const SurfelMap& map,
                                                   Backend backend,
                                                   const SensorModel& sensor,
                                                   const EngineConfig& config,
                                                   ThreadPool& pool) {
  Result<std::unique_ptr<SplatEngine>> engine = MakeSplatEngine(backend, sensor, config, pool);
  if (!engine) return engine;
  std::vector<std::vector<std::size_t>> rows(map.T_map_keyframe.size());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    rows[static_cast<std::size_t>(map.keyframe[i])].push_back(i);
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const int anchor = (*engine)->AddAnchor(map.T_map_keyframe[k]);
    if (rows[k].empty()) continue;
    const SE3 T_anchor_map = map.T_map_keyframe[k].Inverse();
    GaussianColumns<float> table;
    table.Resize(rows[k].size());
    for (std::size_t row = 0; row < rows[k].size(); ++row) {
      MoveInto(T_anchor_map, map.gaussians, rows[k][row], table, row);
    }
    (*engine)->Append(anchor, table);
  }
  return engine;
}

double VoxelFor(const SurfelMap& map) {
  std::vector<float> extent(map.Size());
  for (std::size_t i = 0; i < map.Size(); ++i) {
    extent[i] = std::exp(
        std::min(map.gaussians.Column(kLogScaleU)[i], map.gaussians.Column(kLogScaleV)[i]));
  }
  const auto middle = extent.begin() + static_cast<std::ptrdiff_t>(extent.size() / 2);
  std::nth_element(extent.begin(), middle, extent.end());
  const double voxel = std::clamp(0.5 * static_cast<double>(*middle), 0.02, 0.5);
  const double digit = std::pow(10.0, std::floor(std::log10(voxel)) - 1.0);
  return std::round(voxel / digit) * digit;
}

}  // namespace covsplat
