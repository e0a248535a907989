// A config struct with a field of every kind.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "covsplat/core/config_field.hpp"

namespace covsplat {

enum class ToyMode { kFast, kExact };
template <>
struct EnumNames<ToyMode> {
  static constexpr std::array<EnumName<ToyMode>, 2> kNames{
      {{ToyMode::kFast, "fast"}, {ToyMode::kExact, "exact"}}};
};

struct ToyGicp {
  int max_iterations = 30;
  double max_correspondence_m = 1.0;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("max_iterations", c.max_iterations, Range{1, 200}, "Gauss-Newton steps at most");
    v.Field("max_correspondence_m",
            c.max_correspondence_m,
            Range{0.01, 10.0},
            "reject pairs farther apart than this");
  }
};

struct ToyTracking {
  bool enabled = true;
  ToyMode mode = ToyMode::kExact;
  ToyGicp gicp;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("enabled", c.enabled, "track at all | or not");
    v.Field("mode", c.mode, "how to search");
    v.Section("gicp", c.gicp, "Registration of a scan.");
  }
};

struct ToyConfig {
  std::string name = "a \"quoted\" name\n";
  std::vector<double> elevation_deg = {1.5, -0.1, 1e-7};
  ToyTracking tracking;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Field("name", c.name, "free text");
    v.Field("elevation_deg", c.elevation_deg, Range{-90, 90}, "one per beam");
    v.Section("tracking", c.tracking, "Tracking of scans.");
  }
};

}  // namespace covsplat
