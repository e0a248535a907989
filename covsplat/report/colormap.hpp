// Numbers as colours: ranges, signed errors and normals.
#pragma once

#include <Eigen/Core>

#include "covsplat/core/image.hpp"
#include "covsplat/report/png.hpp"

namespace covsplat {

/// Shown where there is nothing to show.
inline constexpr Rgb kNoDataColor{38, 40, 46};

/// Viridis, 0 dark to 1 bright: equal steps look equal, also without colour vision. Numbers outside
/// [0, 1] are clamped, NaN is kNoDataColor.
Rgb RangeColor(double fraction);

/// Blue (-1) over white (0) to red (1), clamped; NaN is kNoDataColor.
Rgb DivergingColor(double fraction);

/// x, y, z of a unit normal from [-1, 1] to red, green, blue; a zero or broken one is kNoDataColor.
Rgb NormalColor(const Eigen::Vector3f& normal);

/// Ranges from near (bright) to far (dark) on a logarithmic scale; 0 and below is no return.
Image<Rgb> ColorizeRange(const Image<float>& range_m, double near_m, double far_m);

/// Errors within +-limit; NaN where there is none.
Image<Rgb> ColorizeSigned(const Image<float>& error, double limit);

Image<Rgb> ColorizeNormals(const Image<Eigen::Vector3f>& normals);

}  // namespace covsplat
