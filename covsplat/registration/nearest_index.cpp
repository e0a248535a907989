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

// Squared distance between a position and a box, both in edges of the box.
float SquaredGap(const Eigen::Vector3f& position, const Eigen::Vector3i& low) {
  const Eigen::Array3f edge = low.cast<float>().array();
  const Eigen::Array3f beyond = position.array() - edge - 1.0f;
  return (edge - position.array()).max(beyond).max(0.0f).matrix().squaredNorm();
}

// The lowest `count` bits.
std::uint64_t Lowest(int count) {
  return count >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
}

}  // namespace

NearestIndex::NearestIndex(std::span<const Eigen::Vector3f> points, float cell_m)
    : cells_per_m_(1.0f / cell_m), block_ids_(points.size() / 64) {
  COVSPLAT_CHECK(cell_m > 0.0f);
  const std::size_t n = points.size();
  std::vector<std::pair<int, int>> place(n);  // block and cell in it
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3i cell = CellOf(points[i] * cells_per_m_);
    const int block = block_ids_.FindOrInsert(BlockOf(cell), static_cast<int>(blocks_.size()));
    if (block == static_cast<int>(blocks_.size())) blocks_.emplace_back();
    place[i] = {block, CellInBlock(cell)};
    blocks_[static_cast<std::size_t>(block)].cells |= std::uint64_t{1} << place[i].second;
  }
  int cells = 0;
  for (Block& block : blocks_) {
    block.first = cells;
    cells += std::popcount(block.cells);
  }
  const auto cell_of = [&](std::size_t i) {
    const Block& block = blocks_[static_cast<std::size_t>(place[i].first)];
    const int cell = block.first + std::popcount(block.cells & Lowest(place[i].second));
    return static_cast<std::size_t>(cell);
  };
  begin_.assign(static_cast<std::size_t>(cells) + 1, 0);
  for (std::size_t i = 0; i < n; ++i) ++begin_[cell_of(i) + 1];
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];

  order_.resize(n);
  for (std::vector<float>* axis : {&x_, &y_, &z_}) axis->resize(n + kLanes - 1);
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const auto slot = static_cast<std::size_t>(next[cell_of(i)]++);
    order_[slot] = static_cast<int>(i);
    x_[slot] = points[i].x();
    y_[slot] = points[i].y();
    z_[slot] = points[i].z();
  }
}

std::uint64_t NearestIndex::CellsWithin(const Box& box, const Eigen::Vector3i& block) {
  const Eigen::Vector3i origin = kBlockEdge * block;
  const Eigen::Array3i low = (box.low - origin).array().max(0);
  const Eigen::Array3i end = (box.high - origin).array().min(kBlockEdge - 1) + 1;
  const auto between = [](int from, int to) { return Lowest(to) & ~Lowest(from); };
  return between(16 * low.x(), 16 * end.x()) &
         0x0001'0001'0001'0001u * between(4 * low.y(), 4 * end.y()) &
         0x1111'1111'1111'1111u * between(low.z(), end.z());
}

// How far a point may be to matter, in cells.
float NearestIndex::Reach(const Search& search) const {
  constexpr float kSlack = 1.0001f;  // covers rounding
  return (std::sqrt(search.squared) + search.margin_m) * cells_per_m_ * kSlack;
}

void NearestIndex::ScanBlock(const Eigen::Vector3i& at, std::uint64_t cells, Search& search) const {
  const int found = block_ids_.Find(at);
  if (found < 0) return;
  const Block& block = blocks_[static_cast<std::size_t>(found)];
  ForEachCell(block, cells, [&](int bit, int begin, int end) {
    const Eigen::Vector3i cell = kBlockEdge * at + Eigen::Vector3i(bit >> 4, bit >> 2 & 3, bit & 3);
    const float reach = Reach(search);
    if (SquaredGap(search.position, cell) <= reach * reach) ScanSlots(begin, end, search);
  });
}

// Four points at a time; few are nearer than what was found before.
void NearestIndex::ScanSlots(int begin, int end, Search& search) const {
  for (int slot = begin; slot < end; slot += kLanes) {
    const auto at = static_cast<std::size_t>(slot);
    const Four squared = SquaredDistances(&x_[at], &y_[at], &z_[at], search.query);
    const auto nearer = hn::Le(squared, hn::Set(kFour, search.second_squared));
    if (hn::AllFalse(kFour, nearer)) continue;
    alignas(16) std::array<float, kLanes> lanes;
    hn::Store(squared, kFour, lanes.data());
    const int count = std::min(kLanes, end - slot);
    for (int k = 0; k < count; ++k) Consider(slot + k, lanes[static_cast<std::size_t>(k)], search);
  }
}

void NearestIndex::Consider(int slot, float squared, Search& search) const {
  if (!(squared <= search.second_squared) || slot == search.slot) return;
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
  Search search{.query = query,
                .position = query * cells_per_m_,
                .margin_m = margin_m,
                .squared = max_squared};
  if (hint >= 0) {
    const auto at = static_cast<std::size_t>(hint);
    const float squared = hn::GetLane(SquaredDistances(&x_[at], &y_[at], &z_[at], query));
    if (squared < max_squared) {
      search.squared = squared;
      search.slot = hint;
    }
  }
  const Eigen::Vector3i home = CellOf(search.position);
  const Eigen::Vector3i home_block = BlockOf(home);
  const std::uint64_t home_cell = std::uint64_t{1} << CellInBlock(home);
  ScanBlock(home_block, home_cell, search);
  // The other cells that the sphere of the best distance so far and the margin reaches.
  const float radius = Reach(search);
  const Box box{CellOf((search.position.array() - radius).matrix()),
                CellOf((search.position.array() + radius).matrix())};
  ScanBlock(home_block, CellsWithin(box, home_block) & ~home_cell, search);
  const Eigen::Vector3f in_blocks = search.position / kBlockEdge;
  ForEachBlock(box, [&](const Eigen::Vector3i& at) {
    if (at == home_block) return;
    const float reach = Reach(search) / kBlockEdge;
    if (SquaredGap(in_blocks, at) <= reach * reach) ScanBlock(at, CellsWithin(box, at), search);
  });
  if (search.slot < 0) return {};
  const float distance = std::sqrt(search.squared);
  return {
      search.slot, search.squared, std::min(std::sqrt(search.second_squared), distance + margin_m)};
}

}  // namespace covsplat
