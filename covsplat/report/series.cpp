#include "covsplat/report/series.hpp"

#include <algorithm>
#include <cmath>

namespace covsplat {

Series KeepExtremes(const Series& series, std::size_t buckets) {
  const std::size_t n = series.Size();
  const auto end = series.x.begin() + static_cast<std::ptrdiff_t>(n);
  if (n <= 2 * buckets || !std::is_sorted(series.x.begin(), end)) return series;
  Series kept = series;
  kept.x.clear();
  kept.y.clear();
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    const auto at = [&](std::size_t i) {
      return series.y.begin() + static_cast<std::ptrdiff_t>(i * n / buckets);
    };
    const auto less = [](double a, double b) { return a < b || (std::isnan(b) && !std::isnan(a)); };
    const auto [low, high] = std::minmax_element(at(bucket), at(bucket + 1), less);
    for (const auto& it : {std::min(low, high), std::max(low, high)}) {
      kept.x.push_back(series.x[static_cast<std::size_t>(it - series.y.begin())]);
      kept.y.push_back(*it);
    }
  }
  return kept;
}

std::vector<double> Average(const std::vector<double>& values, std::size_t buckets) {
  const std::size_t n = values.size();
  const std::size_t count = std::min(n, buckets);
  std::vector<double> means(count, 0.0);
  for (std::size_t bucket = 0; bucket < count; ++bucket) {
    const std::size_t begin = bucket * n / count;
    const std::size_t end = (bucket + 1) * n / count;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isfinite(values[i])) means[bucket] += values[i] / static_cast<double>(end - begin);
    }
  }
  return means;
}

}  // namespace covsplat
