// Range images that the map was not trained on: measured, rendered, and the difference.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "covsplat/report/colormap.hpp"
#include "covsplat/report/format.hpp"
#include "covsplat/report/html.hpp"
#include "covsplat/report/report_sections.hpp"

namespace covsplat::internal {
namespace {

/// One scale for all scans of a report, so that pictures compare.
struct Scale {
  double near_m = 1.0;
  double far_m = 10.0;
  double error_m = 0.2;
};

bool HasPicture(const HeldOutScan& scan) {
  return !scan.measured_m.Empty() && scan.measured_m.Rows() == scan.rendered_m.Rows() &&
         scan.measured_m.Columns() == scan.rendered_m.Columns();
}

/// Rendered minus measured, NaN where one of them shows nothing.
Image<float> ErrorOf(const HeldOutScan& scan) {
  Image<float> error(scan.measured_m.Rows(), scan.measured_m.Columns());
  for (std::size_t i = 0; i < error.Size(); ++i) {
    const float measured = scan.measured_m.Pixels()[i];
    const float rendered = scan.rendered_m.Pixels()[i];
    error.Pixels()[i] = measured > 0.0F && rendered > 0.0F
                            ? rendered - measured
                            : std::numeric_limits<float>::quiet_NaN();
  }
  return error;
}

Scale ScaleOf(const std::vector<HeldOutScan>& scans) {
  std::vector<float> ranges;
  std::vector<float> errors;
  for (const HeldOutScan& scan : scans) {
    if (!HasPicture(scan)) continue;
    for (const float range : scan.measured_m.Pixels()) {
      if (range > 0.0F && std::isfinite(range)) ranges.push_back(range);
    }
    const Image<float> error = ErrorOf(scan);
    for (const float e : error.Pixels()) {
      if (std::isfinite(e)) errors.push_back(std::abs(e));
    }
  }
  std::sort(ranges.begin(), ranges.end());
  std::sort(errors.begin(), errors.end());
  Scale scale;
  if (!ranges.empty()) {
    scale.near_m = static_cast<double>(ranges[ranges.size() / 50]);
    scale.far_m =
        std::max(scale.near_m * 1.1, static_cast<double>(ranges[ranges.size() * 49 / 50]));
  }
  if (errors.empty()) return scale;
  const double typical = static_cast<double>(errors[errors.size() * 9 / 10]);
  for (const double limit : {0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0}) {
    scale.error_m = limit;
    if (typical <= limit) break;
  }
  return scale;
}

template <class Color>
std::string Gradient(Color&& color) {
  std::string stops;
  for (int i = 0; i <= 10; ++i) {
    const Rgb c = color(0.1 * i);
    stops += fmt::format(",rgb({},{},{})", c.r, c.g, c.b);
  }
  return "linear-gradient(90deg" + stops + ")";
}

std::string Scales(const Scale& scale) {
  return fmt::format(
      "<div class='scales'><span class='scale'>{} <i style='background:{}'></i> {}</span>"
      "<span class='scale'>map {} nearer <i style='background:{}'></i> {} farther</span>"
      "<span class='scale'><i class='none' style='background:rgb({},{},{})'></i> nothing</span>"
      "</div>",
      FormatMetres(scale.near_m),
      Gradient([](double t) { return RangeColor(1.0 - t); }),
      FormatMetres(scale.far_m),
      FormatMetres(scale.error_m),
      Gradient([](double t) { return DivergingColor(2.0 * t - 1.0); }),
      FormatMetres(scale.error_m),
      kNoDataColor.r,
      kNoDataColor.g,
      kNoDataColor.b);
}

std::string Strip(const char* name, const Image<Rgb>& image) {
  return fmt::format(
      "<div class='strip'><span>{}</span>{}</div>", name, ImageTag(image, name, "range"));
}

std::string Metres(const std::optional<double>& metres) {
  return metres ? FormatMetres(*metres) : "n/a";
}

/// "8.1 cm to 3.2 cm"
std::string Outcome(const HeldOutScan& scan) {
  if (!scan.before_m && !scan.after_m) return "";
  const bool worse = scan.before_m && scan.after_m && *scan.after_m > *scan.before_m;
  return fmt::format("<span>mean absolute error {} → <b{}>{}</b></span>",
                     Metres(scan.before_m),
                     worse ? " class='worse'" : "",
                     Metres(scan.after_m));
}

std::string ScanPictures(const HeldOutScan& scan, const Scale& scale) {
  return fmt::format("<div class='scan'><h3>Scan {} {}</h3>{}{}{}</div>\n",
                     scan.scan,
                     Outcome(scan),
                     Strip("measured", ColorizeRange(scan.measured_m, scale.near_m, scale.far_m)),
                     Strip("rendered", ColorizeRange(scan.rendered_m, scale.near_m, scale.far_m)),
                     Strip("error", ColorizeSigned(ErrorOf(scan), scale.error_m)));
}

std::string Change(const HeldOutScan& scan) {
  if (!scan.before_m || !scan.after_m || !(*scan.before_m > 0.0)) return "n/a";
  const double percent = 100.0 * (*scan.after_m / *scan.before_m - 1.0);
  if (!std::isfinite(percent)) return "n/a";
  return fmt::format("<span class='{}'>{:+.0f} %</span>", percent <= 0.0 ? "good" : "bad", percent);
}

std::string Row(const std::string& name, const HeldOutScan& scan) {
  return fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                     name,
                     Metres(scan.before_m),
                     Metres(scan.after_m),
                     Change(scan));
}

/// All scans and their mean.
std::string ErrorTable(const std::vector<HeldOutScan>& scans) {
  std::string rows;
  for (const HeldOutScan& scan : scans) {
    if (scan.before_m || scan.after_m) rows += Row(fmt::format("scan {}", scan.scan), scan);
  }
  if (rows.empty()) return "";
  if (scans.size() > 1) rows += Row("<b>mean</b>", MeanHeldOut(scans));
  return "<div class='scan'><table><tr><th>held-out scan</th><th>before optimisation</th>"
         "<th>after</th><th>change</th></tr>" +
         rows + "</table></div>";
}

}  // namespace

HeldOutScan MeanHeldOut(const std::vector<HeldOutScan>& scans) {
  double before = 0.0;
  double after = 0.0;
  int count = 0;
  for (const HeldOutScan& scan : scans) {
    if (!scan.before_m || !scan.after_m) continue;
    before += *scan.before_m;
    after += *scan.after_m;
    ++count;
  }
  HeldOutScan mean;
  if (count == 0) return mean;
  mean.before_m = before / count;
  mean.after_m = after / count;
  return mean;
}

std::string HeldOutSection(const ReportData& data) {
  if (data.held_out.empty()) return "";
  const Scale scale = ScaleOf(data.held_out);
  std::string pictures;
  for (const HeldOutScan& scan : data.held_out) {
    if (HasPicture(scan)) pictures += ScanPictures(scan, scale);
  }
  return Card(
      "Held-out scans",
      "What the map shows where the sensor was at scans that it was not trained on, against "
      "what the sensor measured there.",
      (pictures.empty() ? "" : Scales(scale) + pictures) + ErrorTable(data.held_out));
}

}  // namespace covsplat::internal
