// SavedMap: a finished map as plain data, which is what every map file holds in its own way.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "covsplat/core/sensor_model.hpp"
#include "covsplat/core/trajectory.hpp"
#include "covsplat/mapping/gaussian_map.hpp"

namespace covsplat {

/// Standard deviation of a saved Gaussian along its normal; formats of 3D Gaussians ask for one.
inline constexpr float kThicknessM = 1e-4f;

/// Gaussians in the map frame, one row each, without padding.
struct SavedMap {
  GaussianColumns<float> gaussians;
  std::vector<float> confidence;     ///< u
  std::vector<float> control_score;  ///< c, -1 where unknown
  std::vector<float> intensity;      ///< mean of its measurements, 0 if the recording has none
  std::vector<int> keyframe;         ///< that the Gaussian came with, -1 where unknown
  std::vector<int> last_seen;        ///< keyframe that last agreed with it, -1 where unknown

  Trajectory keyframes;               ///< their poses in the map frame; empty if not known
  std::optional<SensorModel> sensor;  ///< that made the map, if it is known
  std::string config_yaml;            ///< of the run that made it; empty if not known

  std::size_t Size() const { return gaussians.Size(); }
  /// Of all columns; new rows have signals as where they are unknown.
  void Resize(std::size_t size);
};

/// All Gaussians, moved from their keyframes' frames to the map frame. What GaussianMap does not
/// know (the keyframes' times, the sensor, the configuration) stays empty.
SavedMap FlattenMap(const GaussianMap& map);

/// The map of some of its rows, in their order.
SavedMap SelectRows(const SavedMap& map, std::span<const std::size_t> rows);

Eigen::Vector3f NormalOf(const GaussianColumns<float>& gaussians, std::size_t row);

/// Sets row `row` from a 3D Gaussian: the thinnest of its axes becomes the normal.
void SetRow(SavedMap& map,
            std::size_t row,
            const Eigen::Vector3f& mean,
            const Eigen::Quaternionf& rotation,
            const Eigen::Vector3f& log_scale,
            float opacity_logit);

}  // namespace covsplat
