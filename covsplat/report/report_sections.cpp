#include "covsplat/report/report_sections.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "covsplat/core/percentile.hpp"
#include "covsplat/report/format.hpp"
#include "covsplat/report/html.hpp"

namespace covsplat::internal {
namespace {

std::string Tile(const std::string& label,
                 const std::string& value,
                 const std::string& note,
                 bool warn = false) {
  return fmt::format(
      "<div class='tile{}'><div class='label'>{}</div><div class='value'>{}</div>"
      "<div class='note'>{}</div></div>\n",
      warn ? " warn" : "",
      EscapeHtml(label),
      EscapeHtml(value),
      EscapeHtml(note));
}

Series View(const std::vector<Eigen::Vector3d>& path, int x_axis, int y_axis) {
  Series series;
  for (const Eigen::Vector3d& p : path) {
    series.x.push_back(p[x_axis]);
    series.y.push_back(p[y_axis]);
  }
  return series;
}

Series Marks(const ReportData& data,
             const std::vector<std::size_t>& at,
             const std::string& name,
             int color,
             int x_axis,
             int y_axis) {
  std::vector<Eigen::Vector3d> places;
  for (const std::size_t i : at) {
    if (i < data.trajectory_m.size()) places.push_back(data.trajectory_m[i]);
  }
  Series series = View(places, x_axis, y_axis);
  series.name = name;
  series.style = Series::Style::kPoints;
  series.color = color;
  return series;
}

std::string TrajectoryPlot(const ReportData& data,
                           const PlotOptions& options,
                           int x_axis,
                           int y_axis) {
  constexpr int kTrack = 0, kKeyframe = 1, kTruth = 2, kClosed = 3, kRejected = 4;
  std::vector<Series> curves;
  if (!data.truth_m.empty()) {
    curves.push_back(View(data.truth_m, x_axis, y_axis));
    curves.back().name = "ground truth";
    curves.back().style = Series::Style::kDashed;
    curves.back().color = kTruth;
  }
  curves.push_back(View(data.trajectory_m, x_axis, y_axis));
  curves.back().name = "covsplat";
  curves.back().color = kTrack;
  const auto mark = [&](const std::vector<std::size_t>& at, const char* name, int color) {
    Series marks = Marks(data, at, name, color, x_axis, y_axis);
    if (marks.Size() > 0) curves.push_back(std::move(marks));
  };
  mark(data.keyframes, "keyframes", kKeyframe);
  mark(data.loops_rejected, "no loop", kRejected);
  mark(data.loops_closed, "loops", kClosed);
  return PlotSvg(options, curves);
}

/// y over 0, 1, 2, ...
Series PerIndex(const std::vector<double>& values, double scale, int color) {
  Series series;
  for (std::size_t i = 0; i < values.size(); ++i) {
    series.x.push_back(static_cast<double>(i));
    series.y.push_back(values[i] * scale);
  }
  series.color = color;
  return series;
}

double Quantile(std::vector<double> values, double share) {
  return values.empty() ? std::nan("") : Percentile(values, share);
}

std::vector<double> FiniteOnly(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  return values;
}

std::string StageTable(const std::vector<StackLayer>& stages) {
  std::string rows;
  double all = 0.0;
  std::vector<double> sums;
  for (const StackLayer& stage : stages) {
    const std::vector<double> ms = FiniteOnly(stage.values);
    sums.push_back(std::accumulate(ms.begin(), ms.end(), 0.0));
    all += sums.back();
  }
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const std::vector<double> ms = FiniteOnly(stages[i].values);
    rows += fmt::format(
        "<tr><td><span class='swatch' style='background:{}'></span>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{:.0f} %</td></tr>",
        PaletteColor(static_cast<int>(i)),
        EscapeHtml(stages[i].name),
        FormatNumber(sums[i] / static_cast<double>(ms.size())),
        FormatNumber(Quantile(ms, 0.5)),
        FormatNumber(Quantile(ms, 0.95)),
        all > 0.0 ? 100.0 * sums[i] / all : 0.0);
  }
  return "<table><tr><th>stage</th><th>mean (ms)</th><th>median (ms)</th><th>95 % (ms)</th>"
         "<th>share</th></tr>" +
         rows + "</table>";
}

std::string StagesPlot(const std::vector<StackLayer>& stage_ms) {
  return StackedSvg({.title = "Time per scan",
                     .x_label = "scan",
                     .y_label = "ms",
                     .width_px = 1120,
                     .height_px = 300},
                    stage_ms) +
         StageTable(stage_ms);
}

std::string LatencyPlot(const std::vector<double>& latency_ms) {
  const std::vector<double> ms = FiniteOnly(latency_ms);
  const std::string plot = PlotSvg({.title = "Latency, from scan in to pose out",
                                    .x_label = "scan",
                                    .y_label = "ms",
                                    .width_px = 1120,
                                    .height_px = 220,
                                    .y_from_zero = true},
                                   std::vector<Series>{PerIndex(latency_ms, 1.0, 0)});
  const std::string values = fmt::format("<td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                                         FormatNumber(Quantile(ms, 0.5)),
                                         FormatNumber(Quantile(ms, 0.95)),
                                         FormatNumber(Quantile(ms, 0.99)),
                                         FormatNumber(Quantile(ms, 1.0)));
  return plot +
         "<table><tr><th>latency</th><th>median (ms)</th><th>95 % (ms)</th><th>99 % (ms)</th>"
         "<th>most (ms)</th></tr><tr><td>all scans</td>" +
         values + "</tr></table>";
}

std::string DetailRow(const std::string& what, const std::string& value, bool code = false) {
  if (value.empty()) return "";
  return fmt::format("<tr><td class='key'>{}</td><td class='text'>{}{}{}</td></tr>",
                     EscapeHtml(what),
                     code ? "<code>" : "",
                     EscapeHtml(value),
                     code ? "</code>" : "");
}

}  // namespace

std::string Card(const std::string& title, const std::string& intro, const std::string& html) {
  const std::string paragraph = intro.empty() ? "" : "<p>" + EscapeHtml(intro) + "</p>";
  return fmt::format(
      "<section class='card'><h2>{}</h2>{}{}</section>\n", EscapeHtml(title), paragraph, html);
}

std::string TilesSection(const ReportData& data) {
  const ReportSummary& s = data.summary;
  const auto count = [](std::int64_t n) { return FormatCount(static_cast<double>(n)); };
  std::string lost = s.lost_scans == 0 ? "none lost" : count(s.lost_scans) + " lost";
  if (s.late_scans > 0) lost += ", " + count(s.late_scans) + " late";
  if (s.dropped_scans > 0) lost += ", " + count(s.dropped_scans) + " dropped";
  std::string html = Tile("Scans", count(s.scans), lost, s.lost_scans + s.dropped_scans > 0);
  html += Tile("Path", FormatMetres(s.path_length_m), "length of the trajectory");
  html +=
      Tile("Speed", FormatNumber(s.scans_per_s) + " scan/s", FormatSeconds(s.wall_s) + " in all");
  if (!data.latency_ms.empty()) {
    const std::vector<double> ms = FiniteOnly(data.latency_ms);
    html += Tile("Latency",
                 FormatNumber(Quantile(ms, 0.99)) + " ms",
                 "scan in to pose out, 99 % of the scans");
  }
  if (s.ate_rmse_m) {
    html += Tile("Trajectory error", FormatMetres(*s.ate_rmse_m), "ATE RMSE to the ground truth");
  }
  html += Tile("Gaussians", count(s.gaussians), count(s.keyframes) + " keyframes");
  html += Tile("Map file", FormatBytes(s.map_bytes), "map.ply");
  const HeldOutScan depth = MeanHeldOut(data.held_out);
  if (depth.before_m && depth.after_m) {
    html += Tile("Depth error",
                 FormatMetres(*depth.after_m),
                 FormatMetres(*depth.before_m) + " before optimisation");
  }
  html +=
      Tile("Memory", FormatBytes(s.final_rss_bytes), FormatBytes(s.peak_rss_bytes) + " at most");
  return "<div class='tiles'>" + html + "</div>\n";
}

std::string TrajectorySection(const ReportData& data) {
  if (data.trajectory_m.empty()) return "";
  const std::string top = TrajectoryPlot(data,
                                         {.title = "From above",
                                          .x_label = "x (m)",
                                          .y_label = "y (m)",
                                          .width_px = 560,
                                          .height_px = 520,
                                          .equal_aspect = true},
                                         0,
                                         1);
  std::string right = TrajectoryPlot(data,
                                     {.title = "From the side",
                                      .x_label = "x (m)",
                                      .y_label = "z (m)",
                                      .width_px = 560,
                                      .height_px = 255},
                                     0,
                                     2);
  if (!data.drift_m.empty()) {
    const Series drift{.name = "", .x = data.drift_path_m, .y = data.drift_m, .color = 2};
    right += PlotSvg({.title = "Distance to the ground truth",
                      .x_label = "path (m)",
                      .y_label = "error (m)",
                      .width_px = 560,
                      .height_px = 255,
                      .y_from_zero = true},
                     std::vector<Series>{drift});
  }
  return Card("Trajectory",
              "",
              "<div class='columns'><div>" + top + "</div><div>" + right + "</div></div>");
}

std::string MapSection(const ReportData& data) {
  std::string html;
  for (const ReportPicture& picture : data.map_pictures) {
    const std::string image = ImageTag(picture.image, picture.caption, "picture");
    if (image.empty()) continue;
    html += fmt::format(
        "<figure>{}<figcaption>{}</figcaption></figure>", image, EscapeHtml(picture.caption));
  }
  if (html.empty()) return "";
  return Card("Map", "", "<div class='columns'>" + html + "</div>");
}

std::string TimingSection(const ReportData& data) {
  if (data.stage_ms.empty() && data.latency_ms.empty()) return "";
  std::string html;
  if (!data.stage_ms.empty()) html += StagesPlot(data.stage_ms);
  if (!data.latency_ms.empty()) html += LatencyPlot(data.latency_ms);
  return Card("Timing", "", html);
}

std::string TrainingSection(const ReportData& data) {
  if (data.keyframe_steps.empty()) return "";
  Series steps = PerIndex(data.keyframe_steps, 1.0, 1);
  steps.style = Series::Style::kPoints;
  const std::string plot = PlotSvg({.title = "Optimiser steps per keyframe",
                                    .x_label = "keyframe",
                                    .y_label = "steps",
                                    .width_px = 1120,
                                    .height_px = 260,
                                    .y_from_zero = true},
                                   std::vector<Series>{std::move(steps)});
  const std::vector<double> all = FiniteOnly(data.keyframe_steps);
  const std::string spread = fmt::format("Least {}, median {}, most {}.",
                                         FormatCount(Quantile(all, 0.0)),
                                         FormatCount(Quantile(all, 0.5)),
                                         FormatCount(Quantile(all, 1.0)));
  return Card("Optimisation", spread, plot);
}

std::string GrowthSection(const ReportData& data) {
  if (data.gaussians.empty() && data.rss_bytes.empty()) return "";
  const auto plot = [](const std::string& title, const std::string& unit, Series series) {
    return PlotSvg({.title = title,
                    .x_label = "scan",
                    .y_label = unit,
                    .width_px = 560,
                    .height_px = 260,
                    .y_from_zero = true},
                   std::vector<Series>{std::move(series)});
  };
  return Card("Growth",
              "",
              "<div class='columns'>" +
                  plot("Gaussians", "thousands", PerIndex(data.gaussians, 1e-3, 0)) +
                  plot("Memory", "MB", PerIndex(data.rss_bytes, 1e-6, 4)) + "</div>");
}

std::string EventsSection(const ReportData& data) {
  if (data.events.empty()) return "";
  std::string html;
  for (const ReportEvent& event : data.events) {
    html += fmt::format("<li{}><span class='at'>{}</span><span>{}</span></li>",
                        event.level == ReportEvent::Level::kWarning ? " class='warn'" : "",
                        event.scan < 0 ? std::string("run") : fmt::format("scan {}", event.scan),
                        EscapeHtml(event.text));
  }
  return Card("Events", "", "<ul class='events'>" + html + "</ul>");
}

std::string DetailsSection(const ReportData& data) {
  std::string rows = DetailRow("version", data.version) +
                     DetailRow("command", data.command_line, true) + DetailRow("input", data.input);
  for (const auto& [what, value] : data.details) rows += DetailRow(what, value);
  std::string html = rows.empty() ? "" : "<table>" + rows + "</table>";
  if (!data.config_yaml.empty()) {
    html += "<details><summary>Configuration of this run</summary><pre>" +
            EscapeHtml(data.config_yaml) + "</pre></details>";
  }
  return html.empty() ? "" : Card("How it was made", "", html);
}

}  // namespace covsplat::internal
