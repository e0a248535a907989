#include "covsplat/registration/nearest_index.hpp"

#include <algorithm>
#include <cmath>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

// Squared distance between a cell's box and a position, both in cells.
float SquaredGap(const Eigen::Vector3f& position, int x, int y, int z) {
  const auto axis_gap = [](float p, int low) {
    const auto edge = static_cast<float>(low);
    return std::max({edge - p, p - edge - 1.0f, 0.0f});
  };
  const float dx = axis_gap(position.x(), x);
  const float dy = axis_gap(position.y(), y);
  const float dz = axis_gap(position.z(), z);
  return dx * dx + dy * dy + dz * dz;
}

}  // namespace

NearestIndex::NearestIndex(std::span<const Eigen::Vector3f> points, float cell_m)
    : cell_m_(cell_m), cells_per_m_(1.0f / cell_m), cells_(points.size() / 4) {
  COVSPLAT_CHECK(cell_m > 0.0f);
  const std::size_t n = points.size();
  std::vector<int> cell_of(n);
  begin_.assign(1, 0);  // counts, shifted by one, until they are summed up
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3i cell = CellOf(points[i] * cells_per_m_);
    cell_of[i] = cells_.FindOrInsert(cell, static_cast<int>(begin_.size()) - 1);
    if (cell_of[i] + 1 == static_cast<int>(begin_.size())) begin_.push_back(0);
    ++begin_[static_cast<std::size_t>(cell_of[i]) + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];

  order_.resize(n);
  points_.resize(n);
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const auto slot = static_cast<std::size_t>(next[static_cast<std::size_t>(cell_of[i])]++);
    order_[slot] = static_cast<int>(i);
    points_[slot] = points[i];
  }
}

void NearestIndex::ScanCell(const Eigen::Vector3i& cell, Search& search) const {
  const int position = cells_.Find(cell);
  if (position < 0) return;
  const int end = begin_[static_cast<std::size_t>(position) + 1];
  for (int slot = begin_[static_cast<std::size_t>(position)]; slot < end; ++slot) {
    const Eigen::Vector3f offset = points_[static_cast<std::size_t>(slot)] - search.query;
    const float squared = offset.squaredNorm();
    if (!(squared < search.second_squared) || slot == search.slot) continue;
    const bool tie =
        squared == search.squared && search.slot >= 0 && IndexOf(slot) < IndexOf(search.slot);
    if (squared < search.squared || tie) {
      if (search.slot >= 0) search.second_squared = search.squared;
      search.squared = squared;
      search.slot = slot;
    } else {
      search.second_squared = squared;
    }
  }
}

NearestIndex::Match NearestIndex::Nearest(const Eigen::Vector3f& query,
                                          float max_squared,
                                          int hint,
                                          float margin_m) const {
  constexpr float kSlack = 1.0001f;  // covers rounding
  Search search{.query = query, .squared = max_squared};
  if (hint >= 0) {
    const float squared = (points_[static_cast<std::size_t>(hint)] - query).squaredNorm();
    if (squared < max_squared) {
      search.squared = squared;
      search.slot = hint;
    }
  }
  const Eigen::Vector3f position = query * cells_per_m_;
  const Eigen::Vector3i home = CellOf(position);
  ScanCell(home, search);
  // The other cells that the sphere of the best distance so far and the margin reaches.
  const auto reach = [&] { return (std::sqrt(search.squared) + margin_m) * cells_per_m_ * kSlack; };
  const float radius = reach();
  const Eigen::Vector3i low = CellOf((position.array() - radius).matrix());
  const Eigen::Vector3i high = CellOf((position.array() + radius).matrix());
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) {
        if (x == home.x() && y == home.y() && z == home.z()) continue;
        const float limit = reach();
        if (SquaredGap(position, x, y, z) > limit * limit) continue;
        ScanCell({x, y, z}, search);
      }
    }
  }
  if (search.slot < 0) return {};
  const float distance = std::sqrt(search.squared);
  return {
      search.slot, search.squared, std::min(std::sqrt(search.second_squared), distance + margin_m)};
}

}  // namespace covsplat
