// A training view in five bytes per pixel.
#pragma once

#include <cstdint>

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

 private:
  float step_m_ = 0.0f;
  std::vector<std::uint16_t> range_;
  std::vector<std::int8_t> normal_;  ///< [3 x pixels]
};

}  // namespace covsplat
