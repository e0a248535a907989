#include "covsplat/report/colormap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace covsplat {
namespace {

// Viridis of matplotlib (N. Smith and S. van der Walt, CC0), every ninth of its length.
constexpr std::array<Rgb, 10> kViridis{{{68, 1, 84},
                                        {72, 40, 120},
                                        {62, 73, 137},
                                        {49, 104, 142},
                                        {38, 130, 142},
                                        {31, 158, 137},
                                        {53, 183, 121},
                                        {110, 206, 88},
                                        {181, 222, 43},
                                        {253, 231, 37}}};

// RdBu with 7 classes of ColorBrewer (C. Brewer, Apache 2.0), blue first.
constexpr std::array<Rgb, 7> kBlueRed{{{33, 102, 172},
                                       {103, 169, 207},
                                       {209, 229, 240},
                                       {247, 247, 247},
                                       {253, 219, 199},
                                       {239, 138, 98},
                                       {178, 24, 43}}};

std::uint8_t Mix(std::uint8_t a, std::uint8_t b, double share_of_b) {
  return static_cast<std::uint8_t>(std::lround(a + (b - a) * share_of_b));
}

Rgb Interpolate(std::span<const Rgb> anchors, double fraction) {
  if (std::isnan(fraction)) return kNoDataColor;
  const double position = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(anchors.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(position), anchors.size() - 2);
  const double share = position - static_cast<double>(i);
  const Rgb& a = anchors[i];
  const Rgb& b = anchors[i + 1];
  return {Mix(a.r, b.r, share), Mix(a.g, b.g, share), Mix(a.b, b.b, share)};
}

template <class T, class Color>
Image<Rgb> Colorize(const Image<T>& values, Color&& color) {
  Image<Rgb> image(values.Rows(), values.Columns());
  std::transform(values.Pixels().begin(), values.Pixels().end(), image.Pixels().begin(), color);
  return image;
}

}  // namespace

Rgb RangeColor(double fraction) { return Interpolate(kViridis, fraction); }

Rgb DivergingColor(double fraction) { return Interpolate(kBlueRed, 0.5 + 0.5 * fraction); }

Rgb NormalColor(const Eigen::Vector3f& normal) {
  if (!normal.allFinite() || normal.squaredNorm() < 0.25F) return kNoDataColor;
  const Eigen::Vector3f scaled = (normal.normalized().array() * 127.5F + 127.5F).round();
  return {static_cast<std::uint8_t>(scaled.x()),
          static_cast<std::uint8_t>(scaled.y()),
          static_cast<std::uint8_t>(scaled.z())};
}

Image<Rgb> ColorizeRange(const Image<float>& range_m, double near_m, double far_m) {
  const double span = std::log(far_m / near_m);
  return Colorize(range_m, [&](float range) {
    if (!(range > 0.0F)) return kNoDataColor;
    return RangeColor(span > 0.0 ? std::log(far_m / static_cast<double>(range)) / span : 0.5);
  });
}

Image<Rgb> ColorizeSigned(const Image<float>& error, double limit) {
  return Colorize(error, [&](float e) { return DivergingColor(static_cast<double>(e) / limit); });
}

Image<Rgb> ColorizeNormals(const Image<Eigen::Vector3f>& normals) {
  return Colorize(normals, NormalColor);
}

}  // namespace covsplat
