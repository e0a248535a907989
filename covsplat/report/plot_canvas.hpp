// The frame of a plot: where numbers fall on it, its axes, title and legend.
#pragma once

#include <string>
#include <vector>

#include "covsplat/report/axis.hpp"
#include "covsplat/report/plot.hpp"

namespace covsplat {

struct LegendEntry {
  std::string name;
  std::string color;
};

/// Maps numbers to pixels; the bounds must be widened ones.
class PlotCanvas {
 public:
  PlotCanvas(const PlotOptions& options, Bounds x, Bounds y);

  double X(double x) const;
  double Y(double y) const;

  /// The whole SVG: `below` is drawn under the grid lines, `above` over them.
  std::string Finish(const std::string& below,
                     const std::string& above,
                     const std::vector<LegendEntry>& legend) const;

 private:
  std::string Axes() const;
  void EqualiseAspect();

  PlotOptions options_;
  double width_;
  double height_;
  Bounds x_;
  Bounds y_;
};

/// A plot that says that there is nothing to show.
std::string EmptyPlot(const PlotOptions& options);

}  // namespace covsplat
