#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "apps/facts.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "covsplat/io/text.hpp"
#include "covsplat/mapping/map_file.hpp"

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;

/// 5 %, median and 95 % of `value(row)`.
Json Quantiles(std::size_t rows, const std::function<float(std::size_t)>& value) {
  std::vector<float> values;
  for (std::size_t i = 0; i < rows; ++i) {
    if (const float v = value(i); !std::isnan(v)) values.push_back(v);
  }
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {{"percentile_5", at(0.05)}, {"median", at(0.5)}, {"percentile_95", at(0.95)}};
}

void AddStatistics(const SavedMap& map, Json& facts) {
  Eigen::Vector3f low = MeanOf(map.gaussians, 0);
  Eigen::Vector3f high = low;
  for (std::size_t i = 0; i < map.Size(); ++i) {
    low = low.cwiseMin(MeanOf(map.gaussians, i));
    high = high.cwiseMax(MeanOf(map.gaussians, i));
  }
  facts["low_corner_m"] = {low.x(), low.y(), low.z()};
  facts["high_corner_m"] = {high.x(), high.y(), high.z()};
  facts["opacity"] =
      Quantiles(map.Size(), [&](std::size_t i) { return OpacityOf(map.gaussians, i); });
  const auto scale_m = [&](Parameter scale, std::size_t i) {
    return std::exp(map.gaussians.Column(scale)[i]);
  };
  facts["scale_m"] = Quantiles(map.Size(), [&](std::size_t i) {
    return std::max(scale_m(kLogScaleU, i), scale_m(kLogScaleV, i));
  });
  facts["smaller_scale_m"] = Quantiles(map.Size(), [&](std::size_t i) {
    return std::min(scale_m(kLogScaleU, i), scale_m(kLogScaleV, i));
  });
}

/// A signal is there if any Gaussian has it; its quantiles are over all.
void AddSignals(const SavedMap& map, Json& facts) {
  Json signals = Json::object();
  const auto add = [&](const char* name, const auto& values, auto unknown) {
    const auto is_known = [&](auto value) { return value != unknown; };
    if (!std::any_of(values.begin(), values.end(), is_known)) return;
    signals[name] =
        Quantiles(map.Size(), [&](std::size_t i) { return static_cast<float>(values[i]); });
  };
  add("confidence", map.confidence, 0.0f);
  add("control_score", map.control_score, -1.0f);
  add("intensity", map.intensity, 0.0f);
  add("keyframe", map.keyframe, -1);
  add("last_seen", map.last_seen, -1);
  facts["signals"] = signals.empty() ? Json("none") : signals;
}

std::string Describe(const SensorModel& sensor) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  return fmt::format("{} beams from {:+.1f} to {:+.1f} deg, {} columns, ranges {:.1f} to {:.1f} m",
                     sensor.Rows(),
                     sensor.Elevations().front() / kDegree,
                     sensor.Elevations().back() / kDegree,
                     sensor.Columns(),
                     sensor.MinRange(),
                     sensor.MaxRange());
}

}  // namespace

Result<Json> MapFacts(const std::filesystem::path& file) {
  const Result<MapFile> read = ReadMapFile(file);
  if (!read) return Forward(read);
  const SavedMap& map = read->map;
  std::error_code ignored;
  const auto bytes = std::filesystem::file_size(file, ignored);
  Json facts = {{"kind", "map"},
                {"path", file.string()},
                {"format", read->format},
                {"gaussians", map.Size()},
                {"file_bytes", bytes}};
  if (map.Size() > 0) {
    facts["bytes_per_gaussian"] =
        std::round(100.0 * static_cast<double>(bytes) / static_cast<double>(map.Size())) / 100.0;
  }
  facts["sensor"] = map.sensor ? Describe(*map.sensor) : "not in the file";
  facts["configuration"] = map.config_yaml.empty() ? "not in the file" : "in the file";
  facts["keyframe_poses"] = map.keyframes.empty() ? "not in the file" : "in the file";
  if (map.Size() == 0) return facts;
  facts["keyframes"] = 1 + *std::max_element(map.keyframe.begin(), map.keyframe.end());
  AddStatistics(map, facts);
  AddSignals(map, facts);
  return facts;
}

Result<Json> RunFacts(const std::filesystem::path& folder) {
  const Result<std::string> text = ReadFile(folder / "metrics.json");
  if (!text) return Forward(text);
  const Json metrics = Json::parse(*text, nullptr, false);
  if (!metrics.is_object()) {
    return Fail(ErrorCode::kInput,
                "{}: is not the JSON that `covsplat run` writes",
                (folder / "metrics.json").string());
  }
  Json facts = {{"kind", "run"}, {"path", folder.string()}};
  facts.update(metrics);
  return facts;
}

}  // namespace covsplat
