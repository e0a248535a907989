// A training view in five bytes per pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "covsplat/splat/cpu/raster_data.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

/// Ranges in steps of max range / 65535 (1.5 mm at 100 m), normals in steps of 1/127, tile by tile.
class CompactView {
 public:
  CompactView() = default;
  CompactView(const ViewGeometry<float>& view,
              double max_range_m,
              const RangeMeasurement& measurement);

  bool Empty() const { return range_.empty(); }
  void Expand(TileTargets<float>& targets) const;

  // As stored, for backends that expand on their own.
  float StepM() const { return step_m_; }
  const std::vector<std::uint16_t>& Range() const { return range_; }
  const std::vector<std::int8_t>& Normal() const { return normal_; }
  std::size_t ValidRanges() const { return valid_ranges_; }
  std::size_t ValidNormals() const { return valid_normals_; }

 private:
  float step_m_ = 0.0f;
  std::size_t valid_ranges_ = 0;
  std::size_t valid_normals_ = 0;
  std::vector<std::uint16_t> range_;
  std::vector<std::int8_t> normal_;  ///< [3 x pixels]
};

}  // namespace covsplat
