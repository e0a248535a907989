// A report of a run that never was, with every section filled.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "covsplat/core/rng.hpp"
#include "covsplat/report/report.hpp"

namespace covsplat {

inline Image<Rgb> SamplePicture(int rows, int columns) {
  Image<Rgb> image(rows, columns);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double shade = 0.5 + 0.5 * std::sin(0.05 * r) * std::cos(0.03 * c);
      const auto level = static_cast<std::uint8_t>(255 * shade);
      image(r, c) = {level, static_cast<std::uint8_t>(level / 2 + 60), 140};
    }
  }
  return image;
}

inline HeldOutScan SampleHeldOut(std::int64_t number, int rows, int columns) {
  Rng rng(static_cast<std::uint64_t>(number));
  HeldOutScan scan{number, 0.081, 0.023, Image<float>(rows, columns), Image<float>(rows, columns)};
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double angle = 2 * std::numbers::pi * c / columns;
      const double wall = 6.0 / std::max(std::abs(std::sin(angle)), std::abs(std::cos(angle)));
      const double ground = r > rows / 2 ? 1.6 * rows / (r - 0.5 * rows) : 100.0;
      const double range = std::min(wall * (std::sin(3 * angle) > 0.8 ? 0.5 : 1.0), ground);
      const bool lost = rng.Uniform() < 0.03 || (r < rows / 5 && std::cos(angle) > 0.7);
      scan.measured_m(r, c) = lost ? 0.0F : static_cast<float>(range);
      scan.rendered_m(r, c) = static_cast<float>(range + 0.04 * rng.Normal());
    }
  }
  return scan;
}

inline void AddSampleTrajectory(ReportData& data, int scans) {
  Rng rng(1);
  for (int i = 0; i < scans; ++i) {
    const double angle = 2 * std::numbers::pi * i / scans;
    const Eigen::Vector3d truth(14 * std::sin(angle),
                                9 * (1 - std::cos(angle)) + 2 * std::sin(3 * angle),
                                0.3 * std::sin(5 * angle));
    const Eigen::Vector3d error = 0.00006 * i * Eigen::Vector3d(1, -1, 0.4);
    data.truth_m.push_back(truth);
    data.trajectory_m.push_back(truth + error);
    data.drift_path_m.push_back(0.18 * i);
    data.drift_m.push_back(error.norm() + 0.004 * rng.Uniform());
    if (i % 12 == 0) data.keyframes.push_back(static_cast<std::size_t>(i));
  }
}

inline ReportData SampleReport() {
  constexpr int kScans = 420;
  ReportData data;
  data.title = "courtyard";
  data.subtitle = "Simulated handheld recording, 64 x 1024, 420 scans in 42 s";
  data.summary = {kScans, 2, 1, 0, 35, 76.4, 12.7, 33.1, 184213, 21.3e6, 412e6, 455e6, 0.0083};
  AddSampleTrajectory(data, kScans);
  data.map_pictures = {{"From above, 10 cm per pixel, colour is height", SamplePicture(420, 560)},
                       {"From scan 210, colour is the normal", SamplePicture(420, 560)}};
  data.held_out = {SampleHeldOut(57, 64, 1024), SampleHeldOut(191, 64, 1024)};
  data.held_out.push_back({305, 0.064, 0.031, {}, {}});
  Rng rng(2);
  for (const auto& [name, ms] : {std::pair{"read", 3.0},
                                 {"preprocess", 9.0},
                                 {"track", 22.0},
                                 {"keyframe", 4.0},
                                 {"map", 38.0}}) {
    data.stage_ms.push_back({name, {}});
    for (int i = 0; i < kScans; ++i)
      data.stage_ms.back().values.push_back(ms * (0.8 + 0.4 * rng.Uniform()));
  }
  for (int k = 0; k < 35; ++k) data.keyframe_steps.push_back(20.0 + 400.0 / (1 + k));
  for (int i = 0; i < kScans; ++i) {
    data.latency_ms.push_back(34.0 + 8.0 * rng.Uniform());
    data.gaussians.push_back(184213 * (1 - std::exp(-0.008 * i)));
    data.rss_bytes.push_back(180e6 + 232e6 * (1 - std::exp(-0.007 * i)));
  }
  data.events = {
      {ReportEvent::Level::kWarning, 133, "track lost: 412 of 2 100 points found a partner"},
      {ReportEvent::Level::kInfo, 135, "track found again"}};
  data.config_yaml =
      "# Tracking of scans.\ntracking:\n  # Gauss-Newton steps at most (1 to 200)\n  "
      "max_iterations: 30\n";
  data.version = "0.1.0";
  data.command_line = "covsplat run courtyard/ -o out --set tracking.gicp.max_iterations=30";
  data.input = "courtyard/ (KITTI-style folder, 420 scans)";
  data.details = {{"sensor", "64 beams, -22.5 to 22.5 deg, 1024 columns"}, {"threads", "2"}};
  return data;
}

}  // namespace covsplat
