// map.ply: the map as 3DGS viewers read it, with our own signals as further properties.
#pragma once

#include <filesystem>
#include <string_view>

#include "covsplat/mapping/gaussian_map.hpp"

namespace covsplat {

/// What a file holds of a map: Gaussians in the map frame, one row each, without padding.
struct SavedMap {
  GaussianColumns<float> gaussians;
  std::vector<float> confidence;     ///< u
  std::vector<float> control_score;  ///< c, -1 where unknown
  std::vector<float> intensity;      ///< mean of its measurements, 0 if the recording has none
  std::vector<int> keyframe;         ///< that the Gaussian came with
  std::vector<int> last_seen;        ///< keyframe that last agreed with it

  std::size_t Size() const { return gaussians.Size(); }
};

/// All Gaussians, moved from their keyframes' frames to the map frame.
SavedMap FlattenMap(const GaussianMap& map);

Eigen::Vector3f NormalOf(const GaussianColumns<float>& gaussians, std::size_t row);

/// Writes binary little-endian floats, at once: x y z, normal, colour (from the normal, as f_dc),
/// opacity (logit), scale_0 to 2 (logarithm; the third is the thickness of the disc), rot_0 to 3
/// (w x y z), confidence, control_score, intensity, keyframe, last_seen.
Result<void> WriteMapPly(const std::filesystem::path& path, const SavedMap& map);

/// Reads what WriteMapPly wrote. Of other files of 3D Gaussians it reads what they have: signals
/// that are missing are 0, keyframes -1.
Result<SavedMap> ReadMapPly(const std::filesystem::path& path);

}  // namespace covsplat
