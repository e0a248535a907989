// A picture of errors from above.
#pragma once

#include <span>

#include <Eigen/Core>

#include "covsplat/report/png.hpp"

namespace covsplat {

/// Points coloured by the mean error of what lies in a pixel's column: white is none, red is
/// `limit_m` or more; x to the right, y up. One error per point; points that are not finite are
/// left out, and an empty image comes of none.
Image<Rgb> DrawErrorsFromAbove(std::span<const Eigen::Vector3d> points,
                               std::span<const float> errors_m,
                               double limit_m,
                               int size_px = 1000);

}  // namespace covsplat
