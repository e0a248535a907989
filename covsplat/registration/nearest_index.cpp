#include "covsplat/registration/nearest_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <hwy/highway.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr hn::FixedTag<float, 4> kFour;
using Four = hn::Vec<decltype(kFour)>;
constexpr int kLanes = 4;

// Of four points in a row from a position.
HWY_INLINE Four SquaredDistances(const float* x,
                                 const float* y,
                                 const float* z,
                                 const Eigen::Vector3f& query) {
  const Four dx = hn::Sub(hn::LoadU(kFour, x), hn::Set(kFour, query.x()));
  const Four dy = hn::Sub(hn::LoadU(kFour, y), hn::Set(kFour, query.y()));
  const Four dz = hn::Sub(hn::LoadU(kFour, z), hn::Set(kFour, query.z()));
  return hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
}

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
    : cells_per_m_(1.0f / cell_m), cells_(points.size() / 4) {
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
  for (std::vector<float>* axis : {&x_, &y_, &z_}) axis->resize(n + kLanes - 1);
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const auto slot = static_cast<std::size_t>(next[static_cast<std::size_t>(cell_of[i])]++);
    order_[slot] = static_cast<int>(i);
    x_[slot] = points[i].x();
    y_[slot] = points[i].y();
    z_[slot] = points[i].z();
  }
}

// Four points at a time; few are nearer than what was found before.
void NearestIndex::ScanCell(const Eigen::Vector3i& cell, Search& search) const {
  const int position = cells_.Find(cell);
  if (position < 0) return;
  const int end = begin_[static_cast<std::size_t>(position) + 1];
  for (int slot = begin_[static_cast<std::size_t>(position)]; slot < end; slot += kLanes) {
    const auto at = static_cast<std::size_t>(slot);
    const Four squared = SquaredDistances(&x_[at], &y_[at], &z_[at], search.query);
    const auto nearer = hn::Lt(squared, hn::Set(kFour, search.second_squared));
    if (hn::AllFalse(kFour, nearer)) continue;
    alignas(16) std::array<float, kLanes> lanes;
    hn::Store(squared, kFour, lanes.data());
    const int count = std::min(kLanes, end - slot);
    for (int k = 0; k < count; ++k) Consider(slot + k, lanes[static_cast<std::size_t>(k)], search);
  }
}

void NearestIndex::Consider(int slot, float squared, Search& search) const {
  if (!(squared < search.second_squared) || slot == search.slot) return;
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

NearestIndex::Match NearestIndex::Nearest(const Eigen::Vector3f& query,
                                          float max_squared,
                                          int hint,
                                          float margin_m) const {
  constexpr float kSlack = 1.0001f;  // covers rounding
  Search search{.query = query, .squared = max_squared};
  if (hint >= 0) {
    const auto at = static_cast<std::size_t>(hint);
    const float squared = hn::GetLane(SquaredDistances(&x_[at], &y_[at], &z_[at], query));
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
