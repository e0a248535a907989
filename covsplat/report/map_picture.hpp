// Pictures of a map of flat Gaussians from far away, drawn as shaded discs.
#pragma once

#include <span>

#include "covsplat/mapping/saved_map.hpp"
#include "covsplat/report/png.hpp"

namespace covsplat {

/// An orthographic view: x of the view frame to the right, y up, z towards the viewer.
struct MapView {
  Eigen::Matrix3d R_view_map = Eigen::Matrix3d::Identity();  ///< identity: from above
  int width_px = 1000;
  int max_height_px = 1000;
};

/// Gaussians seen from their measured side, coloured by height and shaded, with a path over them.
Image<Rgb> DrawMapView(const SavedMap& map,
                       std::span<const Eigen::Vector3d> path_m,
                       const MapView& view);

}  // namespace covsplat
