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
    : cell_m_(cell_m), cells_per_m_(1.0f / cell_m), cells_(points.size()) {
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
  x_.resize(n);
  y_.resize(n);
  z_.resize(n);
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const auto slot = static_cast<std::size_t>(next[static_cast<std::size_t>(cell_of[i])]++);
    order_[slot] = static_cast<int>(i);
    x_[slot] = points[i].x();
    y_[slot] = points[i].y();
    z_[slot] = points[i].z();
  }
}

inline void NearestIndex::Consider(std::size_t slot,
                                   const Eigen::Vector3f& query,
                                   Match& best) const {
  const float dx = x_[slot] - query.x();
  const float dy = y_[slot] - query.y();
  const float dz = z_[slot] - query.z();
  const float squared = dx * dx + dy * dy + dz * dz;
  if (squared > best.squared_distance) return;
  if (squared == best.squared_distance && (best.slot < 0 || order_[slot] >= IndexOf(best.slot))) {
    return;
  }
  if (squared <= best.squared_distance) best = {static_cast<int>(slot), squared};  // NaN: neither
}

void NearestIndex::ScanCell(const Eigen::Vector3i& cell,
                            const Eigen::Vector3f& query,
                            Match& best) const {
  const int position = cells_.Find(cell);
  if (position < 0) return;
  const auto begin = static_cast<std::size_t>(begin_[static_cast<std::size_t>(position)]);
  const auto end = static_cast<std::size_t>(begin_[static_cast<std::size_t>(position) + 1]);
  for (std::size_t slot = begin; slot < end; ++slot) Consider(slot, query, best);
}

NearestIndex::Match NearestIndex::Nearest(const Eigen::Vector3f& query,
                                          float max_squared,
                                          int hint) const {
  Match best{-1, max_squared};
  if (hint >= 0) Consider(static_cast<std::size_t>(hint), query, best);
  const Eigen::Vector3f position = query * cells_per_m_;
  const Eigen::Vector3i home = CellOf(position);
  ScanCell(home, query, best);
  // The other cells that the sphere of the best distance so far reaches. The slack covers rounding.
  constexpr float kSlack = 1.0001f;
  const float radius = std::sqrt(best.squared_distance) * cells_per_m_ * kSlack;
  const Eigen::Vector3i low = CellOf((position.array() - radius).matrix());
  const Eigen::Vector3i high = CellOf((position.array() + radius).matrix());
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) {
        if (x == home.x() && y == home.y() && z == home.z()) continue;
        const float gap = SquaredGap(position, x, y, z) * cell_m_ * cell_m_;
        if (gap > best.squared_distance * kSlack) continue;
        ScanCell({x, y, z}, query, best);
      }
    }
  }
  if (best.slot < 0) best.squared_distance = std::numeric_limits<float>::infinity();
  return best;
}

}  // namespace covsplat
