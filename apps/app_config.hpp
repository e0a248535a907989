// The configuration of a run, as files and the command line know it.
#pragma once

#include "covsplat/io/recording_layout.hpp"
#include "covsplat/slam/slam_config.hpp"

namespace covsplat {

/// How recordings are read.
struct InputConfig {
  ScanFormat format = ScanFormat::kAuto;
  double kitti_elevation_correction_deg = 0.0;
  double scan_period_s = 0.1;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("format", c.format, "kind of the scan files; auto: the one kind that is there");
    v.Field("kitti_elevation_correction_deg",
            c.kitti_elevation_correction_deg,
            Range{-2.0, 2.0},
            "added to the elevation of KITTI's points, whose calibration is off by 0.195 to 0.205");
    v.Field("scan_period_s",
            c.scan_period_s,
            Range{1e-3, 10.0},
            "from scan to scan where a recording has no stamps");
  }
};

/// Every module that can be configured has its section here.
struct AppConfig {
  InputConfig input;
  SlamConfig slam;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Section("input", c.input, "how recordings are read");
    SlamConfig::Visit(c.slam, v);
  }
};

}  // namespace covsplat
