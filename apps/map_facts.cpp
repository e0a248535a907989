#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "apps/facts.hpp"
#include <nlohmann/json.hpp>

#include "covsplat/io/text.hpp"
#include "covsplat/mapping/map_file.hpp"

namespace covsplat {
namespace {

using Json = nlohmann::ordered_json;

/// 5 %, median and 95 % of `value(row)`.
Json Quantiles(std::size_t rows, const std::function<float(std::size_t)>& value) {
  std::vector<float> values;
  for (std::size_t i = 0; i < rows; ++i) values.push_back(value(i));
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(rows - 1))];
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
  facts["opacity"] = Quantiles(map.Size(), [&](std::size_t i) {
    return 1.0f / (1.0f + std::exp(-map.gaussians.Column(kOpacityLogit)[i]));
  });
  facts["scale_m"] = Quantiles(map.Size(), [&](std::size_t i) {
    return std::exp(
        std::max(map.gaussians.Column(kLogScaleU)[i], map.gaussians.Column(kLogScaleV)[i]));
  });
  facts["confidence"] = Quantiles(map.Size(), [&](std::size_t i) { return map.confidence[i]; });
}

}  // namespace

Result<Json> MapFacts(const std::filesystem::path& file) {
  const Result<SavedMap> map = ReadMapPly(file);
  if (!map) return Forward(map);
  std::error_code ignored;
  Json facts = {{"kind", "map"},
                {"path", file.string()},
                {"gaussians", map->Size()},
                {"file_bytes", std::filesystem::file_size(file, ignored)}};
  if (map->Size() == 0) return facts;
  facts["keyframes"] = 1 + *std::max_element(map->keyframe.begin(), map->keyframe.end());
  AddStatistics(*map, facts);
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
