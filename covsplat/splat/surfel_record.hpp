// What all backends agree on: Gaussians as a view sees them, and tiles. Plain data.
#pragma once

#include <cstddef>
#include <cstdint>

namespace covsplat {

/// Tiles are 4 x 4 pixels: one pixel per lane of a pack.
inline constexpr int kTileSide = 4;
inline constexpr std::size_t kTilePixels = 16;

/// A Gaussian as one view sees it, in the sensor frame: everything a ray needs to meet it.
/// With c the centre, r_u and r_v the axes and s the scales: u = r_u / s_u, v = r_v / s_v, n the
/// normal facing the sensor.
template <class S>
struct alignas(16 * sizeof(S)) SurfelRecord {
  S u[3];
  S v[3];
  S n[3];
  S plane;    ///< <n, c>
  S u_c;      ///< <u, c>
  S v_c;      ///< <v, c>
  S opacity;  ///< 0 when the Gaussian cannot be seen from this view
  S column;   ///< of the centre, px
  S row;      ///< of the centre, px
  S range;    ///< |c|
};
static_assert(sizeof(SurfelRecord<float>) == 64);

/// Gaussians [begin, begin + count) of one anchor, count <= kBlockSize: the unit of projection and
/// optimisation. Block i owns records [16 i, 16 i + 16).
struct GaussianBlock {
  std::uint32_t begin = 0;
  std::uint16_t count = 0;
  std::uint16_t transform = 0;  ///< index into the view's anchor transforms
};

/// T_sensor_anchor, rotation row-major.
template <class S>
struct AnchorTransform {
  S rotation[9];
  S translation[3];
};

/// Footprints are this much larger than what they cover, for their motion until the next binning.
inline constexpr float kFootprintPaddingPx = 0.5f;

/// Tiles [x0, x1] x [y0, y1] that a Gaussian may touch; x beyond the image wraps. Empty: x1 < x0.
struct TileBox {
  std::int16_t x0 = 0;
  std::int16_t x1 = -1;
  std::int16_t y0 = 0;
  std::int16_t y1 = -1;
};

inline bool IsEmpty(const TileBox& box) { return box.x1 < box.x0 || box.y1 < box.y0; }

/// One Gaussian in one tile's list.
struct TilePair {
  std::uint32_t record = 0;
  std::uint32_t slot = 0;  ///< where its 16 gradient sums go; slots are ordered by record
};

}  // namespace covsplat
