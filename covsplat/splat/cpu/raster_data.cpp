#include "covsplat/splat/cpu/raster_data.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {

template <class S>
ViewGeometry<S>::ViewGeometry(const SensorModel& sensor, const RasterConfig& config)
    : rows(sensor.Rows()),
      columns(sensor.Columns()),
      tile_rows((sensor.Rows() + kTileSide - 1) / kTileSide),
      tile_columns(sensor.Columns() / kTileSide),
      row_table(sensor.Table().row.begin(), sensor.Table().row.end()),
      row_table_origin_rad(static_cast<S>(sensor.Table().origin_rad)),
      row_table_samples_per_rad(static_cast<S>(sensor.Table().samples_per_rad)),
      near_m(static_cast<S>(config.near_m)),
      far_m(static_cast<S>(1.2 * sensor.MaxRange())),
      alpha_min(static_cast<S>(config.alpha_min)),
      alpha_cap(static_cast<S>(config.alpha_cap)),
      transmittance_min(static_cast<S>(config.transmittance_min)),
      lowpass(static_cast<S>(config.lowpass)),
      grazing_cosine(static_cast<S>(config.grazing_cosine)),
      depth_ratio(static_cast<S>(config.depth_ratio)),
      two_sided(config.two_sided) {
  for (int tile = 0; tile < tile_columns; ++tile) {
    for (int lane = 0; lane < static_cast<int>(kTilePixels); ++lane) {
      const double azimuth = sensor.ColumnAzimuth(tile * kTileSide + lane % kTileSide);
      cos_azimuth.push_back(static_cast<S>(std::cos(azimuth)));
      sin_azimuth.push_back(static_cast<S>(std::sin(azimuth)));
    }
  }
  for (int tile = 0; tile < tile_rows; ++tile) {
    for (int lane = 0; lane < static_cast<int>(kTilePixels); ++lane) {
      const int row = std::min(tile * kTileSide + lane / kTileSide, rows - 1);
      const double elevation = sensor.Elevations()[static_cast<std::size_t>(row)];
      cos_elevation.push_back(static_cast<S>(std::cos(elevation)));
      sin_elevation.push_back(static_cast<S>(std::sin(elevation)));
    }
  }
}

std::size_t TileBins::ListedPairs() const {
  std::size_t listed = 0;
  for (std::size_t tile = 0; tile < tile_begin.size(); ++tile) {
    listed += tile_end[tile] - tile_begin[tile];
  }
  return listed;
}

template <class S>
void TileImages<S>::Resize(std::size_t tiles) {
  for (auto* image : {&transmittance, &range_sum, &median, &normal_x, &normal_y, &normal_z}) {
    image->assign(tiles * kTilePixels, S(0));
  }
}

template <class S>
void TileGradients<S>::Resize(std::size_t tiles) {
  for (auto* image : {&alpha, &range_sum, &median, &normal_x, &normal_y, &normal_z}) {
    image->assign(tiles * kTilePixels, S(0));
  }
}

template <class S>
void TileTargets<S>::Resize(std::size_t tiles) {
  for (auto* image :
       {&range_m, &normal_x, &normal_y, &normal_z, &surface_x, &surface_y, &surface_z}) {
    image->assign(tiles * kTilePixels, S(0));
  }
  valid_ranges = 0;
  valid_normals = 0;
}

template struct ViewGeometry<float>;
template struct ViewGeometry<double>;
template struct TileImages<float>;
template struct TileImages<double>;
template struct TileGradients<float>;
template struct TileGradients<double>;
template struct TileTargets<float>;
template struct TileTargets<double>;

}  // namespace covsplat
