// Plots as SVG text: no scripts, readable on light and on dark pages.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "covsplat/report/series.hpp"

namespace covsplat {

struct PlotOptions {
  std::string title = "";
  std::string x_label = "";
  std::string y_label = "";
  int width_px = 720;
  int height_px = 300;
  bool equal_aspect = false;  ///< one metre is as long on both axes: for trajectories
  bool y_from_zero = false;
};

/// Curves over common axes.
std::string PlotSvg(const PlotOptions& options, std::span<const Series> series);

/// One layer of a stacked plot; value i belongs to x = i.
struct StackLayer {
  std::string name;
  std::vector<double> values;
};

/// Areas on top of each other, the first one lowest.
std::string StackedSvg(const PlotOptions& options, std::span<const StackLayer> layers);

/// Colour of curve `index`, as CSS.
std::string PaletteColor(int index);

}  // namespace covsplat
