#include "covsplat/report/plot.hpp"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) {
    ++count;
  }
  return count;
}

std::string Plot(const Series& series, const PlotOptions& options = {}) {
  return PlotSvg(options, std::vector<Series>{series});
}

TEST(PlotSvg, SaysWhenThereIsNoData) {
  EXPECT_NE(PlotSvg({}, {}).find("no data"), std::string::npos);
  EXPECT_NE(Plot({.name = "", .x = {NAN, 1.0}, .y = {0.0, INFINITY}}).find("no data"),
            std::string::npos);
  EXPECT_NE(StackedSvg({}, {}).find("no data"), std::string::npos);
}

TEST(PlotSvg, BreaksTheLineWhereNumbersAreMissing) {
  const std::string svg = Plot({.name = "", .x = {0, 1, 2, 3, 4}, .y = {0, 1, NAN, 1, 0}});
  const std::size_t at = svg.find("class='curve'");
  ASSERT_NE(at, std::string::npos);
  const std::string curve = svg.substr(at, svg.find("/>", at) - at);
  EXPECT_EQ(Count(curve, "M"), 2U);
  EXPECT_EQ(Count(svg, "nan"), 0U);
}

TEST(PlotSvg, EqualAspectMakesACircleRound) {
  Series circle{.name = "", .style = Series::Style::kPoints};
  circle.x = {-1, 1, 0, 0};
  circle.y = {0, 0, -1, 1};
  const std::string svg = Plot(circle, {.width_px = 900, .height_px = 300, .equal_aspect = true});
  std::vector<double> x, y;
  for (std::size_t at = 0; (at = svg.find("<circle", at)) != std::string::npos; ++at) {
    double cx = 0.0, cy = 0.0;
    ASSERT_EQ(std::sscanf(svg.c_str() + at, "<circle cx='%lf' cy='%lf'", &cx, &cy), 2);
    x.push_back(cx);
    y.push_back(cy);
  }
  ASSERT_EQ(x.size(), 4U);
  EXPECT_NEAR(x[1] - x[0], y[2] - y[3], 0.3);  // pixels are written with one decimal
}

TEST(PlotSvg, StaysSmallForLongSeries) {
  Series series;
  for (int i = 0; i < 200000; ++i) {
    series.x.push_back(i);
    series.y.push_back(std::sin(i) + (i == 123456 ? 50.0 : 0.0));
  }
  EXPECT_LT(Plot(series).size(), 40000U);
  const Series kept = KeepExtremes(series, 700);
  EXPECT_GT(*std::max_element(kept.y.begin(), kept.y.end()), 49.0);
}

TEST(PlotSvg, EscapesNames) {
  EXPECT_EQ(
      Plot({.name = "<b>", .x = {1}, .y = {1}}, {.title = "<i>", .x_label = "<u>"}).find("<b>"),
      std::string::npos);
}

TEST(StackedSvg, TakesLayersOfDifferentLengthsAndBrokenNumbers) {
  const std::string svg =
      StackedSvg({}, std::vector<StackLayer>{{"a", {1, NAN, 3}}, {"b", {}}, {"c", {1, 2, -3, 9}}});
  EXPECT_EQ(Count(svg, "fill-opacity"), 3U);
  EXPECT_EQ(Count(svg, "nan"), 0U);
}

TEST(Average, KeepsTheMean) {
  EXPECT_EQ(Average({1, 3, 5, 7}, 2), (std::vector<double>{2, 6}));
  EXPECT_EQ(Average({1, 2}, 5), (std::vector<double>{1, 2}));
  EXPECT_TRUE(Average({}, 5).empty());
}

}  // namespace
}  // namespace covsplat
