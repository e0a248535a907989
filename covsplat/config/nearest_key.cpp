#include "covsplat/config/nearest_key.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

#include <fmt/format.h>

namespace covsplat::internal {
namespace {

std::string_view Leaf(std::string_view path) { return path.substr(path.rfind('.') + 1); }

/// Whole paths compare directly; right names in the wrong section cost half of what differs.
int Distance(std::string_view key, std::string_view candidate) {
  const int whole = 2 * EditDistance(key, candidate);
  const int leaf = 2 * EditDistance(Leaf(key), Leaf(candidate));
  return std::min(whole, leaf + 1 + (whole - leaf) / 4);
}

}  // namespace

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

std::string NearestKey(std::string_view key, const ConfigSchema& schema, bool want_section) {
  const bool has_sections =
      std::any_of(schema.begin(), schema.end(), [](const auto& e) { return e.IsSection(); });
  std::string nearest;
  int least = std::numeric_limits<int>::max();
  for (const ConfigEntry& entry : schema) {
    if (entry.IsSection() != (want_section && has_sections)) continue;
    const int distance = Distance(key, entry.path);
    if (distance >= least) continue;
    least = distance;
    nearest = entry.path;
  }
  return nearest;
}

std::string UnknownKey(std::string_view key, const ConfigSchema& schema, bool want_section) {
  constexpr std::size_t kLongestShown = 80;
  const std::string shown(key.substr(0, kLongestShown));
  const std::string nearest = NearestKey(shown, schema, want_section);
  if (nearest.empty()) return fmt::format("unknown key '{}'", shown);
  return fmt::format("unknown key '{}'; did you mean '{}'?", shown, nearest);
}

}  // namespace covsplat::internal
