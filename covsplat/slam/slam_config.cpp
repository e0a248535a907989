#include "covsplat/slam/slam_config.hpp"

#include <string_view>

namespace covsplat {

Result<void> CheckSlamConfig(const SlamConfig& config) {
  struct Order {
    std::string_view low_key;
    double low;
    std::string_view high_key;
    double high;
  };
  const PreprocessConfig& preprocess = config.tracker.preprocess;
  const SpawnConfig& spawn = config.mapper.spawn;
  const Order orders[] = {
      {"preprocess.min_range_m",
       preprocess.min_range_m,
       "preprocess.max_range_m",
       preprocess.max_range_m},
      {"mapping.spawn.min_scale_m",
       spawn.min_scale_m,
       "mapping.spawn.max_scale_m",
       spawn.max_scale_m},
      {"mapping.spawn.min_opacity",
       spawn.min_opacity,
       "mapping.spawn.max_opacity",
       spawn.max_opacity},
  };
  for (const Order& order : orders) {
    if (order.low < order.high) continue;
    return Fail(ErrorCode::kUsage,
                "{} ({}) must be below {} ({})",
                order.low_key,
                order.low,
                order.high_key,
                order.high);
  }
  return {};
}

}  // namespace covsplat
