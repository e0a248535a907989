#include "covsplat/report/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "covsplat/report/axis.hpp"
#include "covsplat/report/plot_canvas.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kBuckets = 700;  // about one per pixel

bool IsFinite(const Series& series, std::size_t i) {
  return std::isfinite(series.x[i]) && std::isfinite(series.y[i]);
}

std::string Circles(const PlotCanvas& canvas, const Series& series, const std::string& color) {
  std::string svg = fmt::format("<g fill='{}'>", color);
  for (std::size_t i = 0; i < series.Size(); ++i) {
    if (!IsFinite(series, i)) continue;
    svg += fmt::format(
        "<circle cx='{:.1f}' cy='{:.1f}' r='2.2'/>", canvas.X(series.x[i]), canvas.Y(series.y[i]));
  }
  return svg + "</g>";
}

/// Skips points that fall on the pixel of the one before.
std::string Line(const PlotCanvas& canvas, const Series& series, const std::string& color) {
  std::string path;
  bool pen_down = false;
  double last_x = 0.0;
  double last_y = 0.0;
  for (std::size_t i = 0; i < series.Size(); ++i) {
    if (!IsFinite(series, i)) {
      pen_down = false;
      continue;
    }
    const double x = canvas.X(series.x[i]);
    const double y = canvas.Y(series.y[i]);
    if (pen_down && std::abs(x - last_x) < 0.5 && std::abs(y - last_y) < 0.5) continue;
    // A lone point shows too: its round cap needs a segment, even one of no length.
    path += fmt::format("{}{:.1f} {:.1f}{}", pen_down ? "L" : "M", x, y, pen_down ? "" : "h0");
    pen_down = true;
    last_x = x;
    last_y = y;
  }
  const bool dashed = series.style == Series::Style::kDashed;
  return fmt::format("<path class='curve' stroke='{}'{} d='{}'/>",
                     color,
                     dashed ? " stroke-dasharray='5 4'" : "",
                     path.empty() ? "M0 0" : path);
}

std::string Area(const PlotCanvas& canvas,
                 const std::vector<double>& low,
                 const std::vector<double>& high,
                 double x_step,
                 const std::string& color) {
  std::string path;
  const auto point = [&](std::size_t i, double y) {
    path += fmt::format("{}{:.1f} {:.1f}",
                        path.empty() ? "M" : "L",
                        canvas.X(static_cast<double>(i) * x_step),
                        canvas.Y(y));
  };
  for (std::size_t i = 0; i < high.size(); ++i) point(i, high[i]);
  for (std::size_t i = low.size(); i-- > 0;) point(i, low[i]);
  return fmt::format("<path fill='{}' fill-opacity='.85' d='{}Z'/>", color, path);
}

/// Running sums of the layers, zero first; all of the same, drawable length.
std::vector<std::vector<double>> StackUp(std::span<const StackLayer> layers, std::size_t scans) {
  std::vector<std::vector<double>> tops{std::vector<double>(std::min(scans, kBuckets), 0.0)};
  for (const StackLayer& layer : layers) {
    std::vector<double> values = layer.values;
    values.resize(scans, 0.0);
    values = Average(values, kBuckets);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = tops.back()[i] + std::max(0.0, values[i]);
    }
    tops.push_back(std::move(values));
  }
  return tops;
}

}  // namespace

std::string PaletteColor(int index) {
  // Mid tones with enough contrast on white and on near black (after Okabe and Ito 2008).
  static constexpr std::array<const char*, 8> kColors = {
      "#2f7ed8", "#e07b00", "#159e7c", "#c2519b", "#8a63d2", "#b3921b", "#35a8d6", "#d2453f"};
  return kColors[static_cast<std::size_t>(std::max(0, index)) % kColors.size()];
}

std::string PlotSvg(const PlotOptions& options, std::span<const Series> series) {
  Bounds x;
  Bounds y;
  for (const Series& s : series) {
    for (std::size_t i = 0; i < s.Size(); ++i) {
      if (!IsFinite(s, i)) continue;
      x.Include(s.x[i]);
      y.Include(s.y[i]);
    }
  }
  if (x.empty) return EmptyPlot(options);
  if (options.y_from_zero) y.Include(0.0);
  Bounds wide_y = Widen(y, 0.06);
  if (options.y_from_zero && y.low == 0.0) wide_y.low = 0.0;
  const PlotCanvas canvas(options, Widen(x, options.equal_aspect ? 0.06 : 0.0), wide_y);

  std::vector<LegendEntry> legend;
  std::string curves;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const Series& s = series[i];
    const std::string color = PaletteColor(s.color >= 0 ? s.color : static_cast<int>(i));
    if (!s.name.empty()) legend.push_back({s.name, color});
    curves += s.style == Series::Style::kPoints ? Circles(canvas, s, color)
                                                : Line(canvas, KeepExtremes(s, kBuckets), color);
  }
  return canvas.Finish("", curves, legend);
}

std::string StackedSvg(const PlotOptions& options, std::span<const StackLayer> layers) {
  std::size_t scans = 0;
  for (const StackLayer& layer : layers) scans = std::max(scans, layer.values.size());
  if (scans == 0) return EmptyPlot(options);
  const std::vector<std::vector<double>> tops = StackUp(layers, scans);
  Bounds y{0.0, 0.0, false};
  for (const double top : tops.back()) y.Include(top);
  const double x_step = static_cast<double>(scans) / static_cast<double>(tops.front().size());
  const double x_last = x_step * static_cast<double>(tops.front().size() - 1);
  const PlotCanvas canvas(
      options, {0.0, std::max(1.0, x_last), false}, {0.0, Widen(y, 0.06).high, false});

  std::vector<LegendEntry> legend;
  std::string areas;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::string color = PaletteColor(static_cast<int>(i));
    areas += Area(canvas, tops[i], tops[i + 1], x_step, color);
    legend.push_back({layers[i].name, color});
  }
  return canvas.Finish(areas, "", legend);
}

}  // namespace covsplat
