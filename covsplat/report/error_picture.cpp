#include "covsplat/report/error_picture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "covsplat/core/check.hpp"
#include "covsplat/report/colormap.hpp"

namespace covsplat {
namespace {

struct Limits {
  double low = 0.0;
  double high = 0.0;
};

/// Of all but the outermost thousandths: a few points far away shall not shrink the rest.
Limits LimitsOf(std::vector<double>& values) {
  const auto outer = static_cast<std::ptrdiff_t>(values.size() / 1000);
  const auto at = [&](std::ptrdiff_t i) {
    std::nth_element(values.begin(), values.begin() + i, values.end());
    return values[static_cast<std::size_t>(i)];
  };
  return {at(outer), at(static_cast<std::ptrdiff_t>(values.size()) - 1 - outer)};
}

/// Where points fall on the picture.
struct Frame {
  Limits x, y;
  double px_per_m = 1.0;

  int Pixels(const Limits& l) const { return static_cast<int>((l.high - l.low) * px_per_m) + 1; }
};

Frame FrameOf(std::span<const Eigen::Vector3d> points, int size_px) {
  std::vector<double> xs, ys;
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) continue;
    xs.push_back(point.x());
    ys.push_back(point.y());
  }
  if (xs.empty()) return {{}, {}, 0.0};
  Frame frame{LimitsOf(xs), LimitsOf(ys)};
  const double longest_m = std::max({frame.x.high - frame.x.low, frame.y.high - frame.y.low, 1e-3});
  frame.px_per_m = (size_px - 1) / longest_m;
  return frame;
}

}  // namespace

Image<Rgb> DrawErrorsFromAbove(std::span<const Eigen::Vector3d> points,
                               std::span<const float> errors_m,
                               double limit_m,
                               int size_px) {
  COVSPLAT_CHECK(points.size() == errors_m.size() && limit_m > 0.0 && size_px > 1);
  const Frame frame = FrameOf(points, size_px);
  if (frame.px_per_m == 0.0) return {};
  Image<float> sum(frame.Pixels(frame.y), frame.Pixels(frame.x));
  Image<float> count(sum.Rows(), sum.Columns());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double column = std::floor((points[k].x() - frame.x.low) * frame.px_per_m);
    const double row = std::floor((frame.y.high - points[k].y()) * frame.px_per_m);
    if (!(column >= 0.0 && column < sum.Columns() && row >= 0.0 && row < sum.Rows())) continue;
    const int i = static_cast<int>(row);
    const int j = static_cast<int>(column);
    sum(i, j) += std::min(errors_m[k], static_cast<float>(limit_m));
    count(i, j) += 1.0f;
  }
  Image<Rgb> picture(sum.Rows(), sum.Columns(), kNoDataColor);
  for (std::size_t i = 0; i < sum.Size(); ++i) {
    if (count.Pixels()[i] == 0.0f) continue;
    const double mean_m = static_cast<double>(sum.Pixels()[i] / count.Pixels()[i]);
    picture.Pixels()[i] = DivergingColor(mean_m / limit_m);
  }
  return picture;
}

}  // namespace covsplat
