#include "covsplat/report/plot_canvas.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "covsplat/report/html.hpp"

namespace covsplat {
namespace {

// Room around the area inside the axes, in pixels.
constexpr double kLeft = 64, kRight = 16, kTop = 36, kBottom = 46;

double Share(double number, const Bounds& bounds) {
  return (std::clamp(number, -1e15, 1e15) - bounds.low) / (bounds.high - bounds.low);
}

std::string Open(const PlotOptions& options) {
  const std::string title = EscapeHtml(options.title);
  return fmt::format(
      "<svg class='plot' xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' role='img' "
      "aria-label='{}'><text class='title' x='4' y='18'>{}</text>",
      options.width_px,
      options.height_px,
      title,
      title);
}

/// Names with a swatch, from the right end of the title's line.
std::string Legend(const PlotOptions& options, const std::vector<LegendEntry>& entries) {
  constexpr double kLetter = 6.4;  // about the width of a letter
  std::string svg = "<g class='legend'>";
  double x = options.width_px - kRight;
  for (auto it = entries.rbegin(); it != entries.rend(); ++it) {
    x -= kLetter * static_cast<double>(it->name.size());
    svg += fmt::format("<text x='{:.1f}' y='18'>{}</text>", x, EscapeHtml(it->name));
    x -= 15;
    svg += fmt::format(
        "<rect x='{:.1f}' y='9' width='10' height='10' rx='2' fill='{}'/>", x, it->color);
    x -= 14;
  }
  return svg + "</g>";
}

std::string Text(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format(
      "<text x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>", x, y, anchor, EscapeHtml(text));
}

}  // namespace

PlotCanvas::PlotCanvas(const PlotOptions& options, Bounds x, Bounds y)
    : options_(options),
      width_(options.width_px - kLeft - kRight),
      height_(options.height_px - kTop - kBottom),
      x_(x),
      y_(y) {
  if (options_.equal_aspect) EqualiseAspect();
}

double PlotCanvas::X(double x) const { return kLeft + Share(x, x_) * width_; }
double PlotCanvas::Y(double y) const { return kTop + (1.0 - Share(y, y_)) * height_; }

void PlotCanvas::EqualiseAspect() {
  const double per_pixel = std::max((x_.high - x_.low) / width_, (y_.high - y_.low) / height_);
  const auto stretch = [](Bounds& bounds, double length) {
    const double middle = 0.5 * (bounds.low + bounds.high);
    bounds = {middle - 0.5 * length, middle + 0.5 * length, false};
  };
  stretch(x_, per_pixel * width_);
  stretch(y_, per_pixel * height_);
}

std::string PlotCanvas::Axes() const {
  const Ticks x_ticks = NiceTicks(x_, static_cast<int>(width_ / 80));
  const Ticks y_ticks = NiceTicks(y_, static_cast<int>(height_ / 32));
  const double bottom = kTop + height_;
  std::string svg = "<g class='axis'>";
  for (const double at : x_ticks.at) {
    svg += fmt::format("<path d='M{:.1f} {:.1f}V{:.1f}'/>", X(at), kTop, bottom);
    svg += Text(X(at), bottom + 16, "middle", x_ticks.Label(at));
  }
  for (const double at : y_ticks.at) {
    svg += fmt::format("<path d='M{:.1f} {:.1f}H{:.1f}'/>", kLeft, Y(at), kLeft + width_);
    svg += Text(kLeft - 7, Y(at) + 4, "end", y_ticks.Label(at));
  }
  svg += Text(kLeft + 0.5 * width_, options_.height_px - 10.0, "middle", options_.x_label);
  return svg + fmt::format(
                   "<text transform='translate(14 {:.1f}) rotate(-90)' text-anchor='middle'>{}"
                   "</text></g>",
                   kTop + 0.5 * height_,
                   EscapeHtml(options_.y_label));
}

std::string PlotCanvas::Finish(const std::string& below,
                               const std::string& above,
                               const std::vector<LegendEntry>& legend) const {
  return Open(options_) + below + Axes() + above + Legend(options_, legend) + "</svg>";
}

std::string EmptyPlot(const PlotOptions& options) {
  return Open(options) +
         fmt::format("<text class='nodata' x='{}' y='{}' text-anchor='middle'>no data</text></svg>",
                     options.width_px / 2,
                     options.height_px / 2);
}

}  // namespace covsplat
