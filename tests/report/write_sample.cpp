// Writes reports of made-up data for the well-formedness check and for looking at.
#include <fstream>
#include <iostream>
#include <string>

#include "tests/report/sample_report.hpp"

namespace covsplat {
namespace {

/// What a run may contain at worst.
ReportData HostileReport() {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  ReportData data;
  data.title = "<script>alert('x')</script> & \"quotes\" \xff\x01 \xc3\xa4";
  data.subtitle = data.input = data.command_line = data.version = data.config_yaml = data.title;
  data.details = {{data.title, data.title}};
  data.events = {{ReportEvent::Level::kWarning, -1, data.title}};
  data.summary.ate_rmse_m = kNan;
  data.summary.scans_per_s = kInf;
  data.summary.path_length_m = -kInf;
  data.trajectory_m = {{0, 0, 0}, {kNan, 1, 2}, {kInf, -kInf, 1}, {1e300, -1e300, 0}};
  data.truth_m = {{kNan, kNan, kNan}};
  data.keyframes = {0, 1, 99};
  data.drift_path_m = {0, kNan, 2};
  data.drift_m = {kInf, 1, kNan, 4};
  data.map_pictures = {{data.title, {}}, {data.title, Image<Rgb>(1, 1)}};
  data.held_out = {{1, kNan, 0.0, Image<float>(2, 4, NAN), Image<float>(2, 4, INFINITY)},
                   {2, 0.0, kInf, Image<float>(2, 4, 1.0F), Image<float>(1, 4, 1.0F)}};
  data.stage_ms = {{data.title, {1, kNan, kInf, -5}}, {"", {}}, {"late", {1, 2, 3, 4, 5, 6}}};
  data.latency_ms = {kNan, kInf, 3.0};
  data.keyframe_steps = {kNan, kInf};
  data.gaussians = {kNan, kNan};
  data.rss_bytes = {kInf, 1e300, -1e300};
  return data;
}

}  // namespace
}  // namespace covsplat

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: write_sample FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  std::ofstream(folder + "/sample.html") << covsplat::MakeReport(covsplat::SampleReport());
  std::ofstream(folder + "/hostile.html") << covsplat::MakeReport(covsplat::HostileReport());
  std::ofstream(folder + "/empty.html") << covsplat::MakeReport(covsplat::ReportData());
  return 0;
}
