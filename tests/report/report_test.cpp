#include "covsplat/report/report.hpp"

#include "tests/report/sample_report.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

bool Contains(const std::string& page, const std::string& part) {
  return page.find(part) != std::string::npos;
}

TEST(Report, ShowsEverySectionThatHasData) {
  const std::string page = MakeReport(SampleReport());
  for (const char* title :
       {"Trajectory", "Map", "Held-out scans", "Timing", "Optimisation", "Growth", "Events"}) {
    EXPECT_TRUE(Contains(page, std::string("<h2>") + title + "</h2>")) << title;
  }
  EXPECT_TRUE(Contains(page, "184 213"));
  EXPECT_TRUE(Contains(page, "8.3 mm"));
  EXPECT_TRUE(Contains(page, "Latency"));
  EXPECT_TRUE(Contains(page, "Optimiser steps per keyframe"));
  EXPECT_TRUE(Contains(page, "2 lost, 1 late"));
  EXPECT_TRUE(Contains(page, "ground truth"));
  EXPECT_TRUE(Contains(page, "max_iterations: 30"));
}

TEST(Report, LeavesOutWhatHasNone) {
  const std::string page = MakeReport(ReportData());
  EXPECT_FALSE(Contains(page, "<section"));
  EXPECT_FALSE(Contains(page, "ATE"));
  EXPECT_TRUE(Contains(page, "Scans"));
}

TEST(Report, EscapesWhatTheUserNamed) {
  ReportData data;
  data.title = data.input = data.command_line = data.config_yaml = "<script>x</script>";
  EXPECT_FALSE(Contains(MakeReport(data), "<script"));
}

TEST(Report, MarksAMapThatGotWorse) {
  ReportData data;
  data.held_out = {{3, 0.02, 0.04, {}, {}}};
  EXPECT_TRUE(Contains(MakeReport(data), "<span class='bad'>+100 %</span>"));
}

TEST(Report, LoadsNothingFromElsewhere) {
  const std::string page = MakeReport(SampleReport());
  EXPECT_FALSE(Contains(page, "href="));
  EXPECT_FALSE(Contains(page, "url("));
  EXPECT_FALSE(Contains(page, "@import"));
}

}  // namespace
}  // namespace covsplat
