// Curves of a plot, and how long ones become short enough to draw.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace covsplat {

/// One named curve. Numbers that are not finite leave a gap.
struct Series {
  enum class Style { kLine, kDashed, kPoints };

  std::string name = "";
  std::vector<double> x = {};
  std::vector<double> y = {};  ///< as long as x; what is longer is ignored
  Style style = Style::kLine;
  int color = -1;  ///< index into the palette; -1 takes the curve's place in the plot

  std::size_t Size() const { return x.size() < y.size() ? x.size() : y.size(); }
};

/// At most about 2 * buckets points that keep the extremes of y; only if x never decreases,
/// otherwise the series itself.
Series KeepExtremes(const Series& series, std::size_t buckets);

/// Consecutive values averaged into at most `buckets`; not finite ones count as zero.
std::vector<double> Average(const std::vector<double>& values, std::size_t buckets);

}  // namespace covsplat
