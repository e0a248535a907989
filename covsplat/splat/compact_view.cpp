#include "covsplat/splat/compact_view.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {
namespace {

constexpr float kRangeSteps = 65535.0f;
constexpr float kNormalSteps = 127.0f;

}  // namespace

CompactView::CompactView(const ViewGeometry<float>& view,
                         double max_range_m,
                         const RangeMeasurement& measurement)
    : step_m_(static_cast<float>(max_range_m) / kRangeSteps),
      range_(view.Tiles() * kTilePixels, 0),
      normal_(3 * view.Tiles() * kTilePixels, 0) {
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      const float range = measurement.range_m(row, column);
      if (!(range > 0.0f)) continue;
      const std::size_t i = PixelIndex(view, row, column);
      range_[i] =
          static_cast<std::uint16_t>(std::clamp(std::round(range / step_m_), 1.0f, kRangeSteps));
      ++valid_ranges_;
      const Eigen::Vector3f& normal = measurement.normal(row, column);
      for (int k = 0; k < 3; ++k) {
        normal_[3 * i + static_cast<std::size_t>(k)] =
            static_cast<std::int8_t>(std::lround(kNormalSteps * normal[k]));
      }
      const std::int8_t* stored = &normal_[3 * i];
      if (stored[0] != 0 || stored[1] != 0 || stored[2] != 0) ++valid_normals_;
    }
  }
}

void CompactView::Expand(TileTargets<float>& targets) const {
  targets.Resize(range_.size() / kTilePixels);
  targets.valid_ranges = valid_ranges_;
  targets.valid_normals = valid_normals_;
  for (std::size_t i = 0; i < range_.size(); ++i) {
    if (range_[i] == 0) continue;
    targets.range_m[i] = step_m_ * static_cast<float>(range_[i]);
    const Eigen::Vector3f normal(normal_[3 * i], normal_[3 * i + 1], normal_[3 * i + 2]);
    if (normal.isZero()) continue;
    const Eigen::Vector3f unit = normal.normalized();
    targets.normal_x[i] = unit.x();
    targets.normal_y[i] = unit.y();
    targets.normal_z[i] = unit.z();
  }
}

}  // namespace covsplat
