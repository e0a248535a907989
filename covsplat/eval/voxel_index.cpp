#include "covsplat/eval/voxel_index.hpp"

#include <cmath>

namespace covsplat {
namespace {

constexpr int kBits = 21;
constexpr int kHalf = 1 << (kBits - 1);
constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;

// The finaliser of SplitMix64: neighbours in space must not share slots, whichever bits they differ
// in.
std::uint64_t Scatter(std::uint64_t key) {
  key = (key ^ (key >> 30)) * 0xBF58476D1CE4E5B9ULL;
  key = (key ^ (key >> 27)) * 0x94D049BB133111EBULL;
  return key ^ (key >> 31);
}

}  // namespace

std::optional<std::uint64_t> VoxelGrid::KeyOf(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d cell = (point / edge_m).array().floor();
  if (!(cell.minCoeff() >= -kHalf && cell.maxCoeff() < kHalf)) return std::nullopt;
  if (!cell.allFinite()) return std::nullopt;
  return KeyOfCell(cell.cast<int>());
}

std::uint64_t VoxelGrid::KeyOfCell(const Eigen::Vector3i& cell) {
  const auto bits = [](int c) { return static_cast<std::uint64_t>(c + kHalf) & kMask; };
  return (bits(cell.x()) << (2 * kBits)) | (bits(cell.y()) << kBits) | bits(cell.z());
}

Eigen::Vector3i VoxelGrid::CellOf(std::uint64_t key) {
  const auto cell = [&](int shift) { return static_cast<int>((key >> shift) & kMask) - kHalf; };
  return {cell(2 * kBits), cell(kBits), cell(0)};
}

Eigen::Vector3d VoxelGrid::CenterOf(std::uint64_t key) const {
  return edge_m * (CellOf(key).cast<double>().array() + 0.5).matrix();
}

std::size_t VoxelIndex::Insert(std::uint64_t key) {
  if (2 * (keys_.size() + 1) > slots_.size()) Grow();
  const std::size_t slot = SlotOf(key);
  if (slots_[slot] == 0) {
    keys_.push_back(key);
    slots_[slot] = static_cast<std::uint32_t>(keys_.size());
  }
  return slots_[slot] - 1;
}

bool VoxelIndex::Contains(std::uint64_t key) const {
  return !slots_.empty() && slots_[SlotOf(key)] != 0;
}

// Of the key, or the free one where it belongs.
std::size_t VoxelIndex::SlotOf(std::uint64_t key) const {
  const std::size_t last = slots_.size() - 1;
  std::size_t slot = Scatter(key) & last;
  while (slots_[slot] != 0 && keys_[slots_[slot] - 1] != key) slot = (slot + 1) & last;
  return slot;
}

void VoxelIndex::Grow() {
  slots_.assign(slots_.empty() ? 64 : 2 * slots_.size(), 0);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    slots_[SlotOf(keys_[i])] = static_cast<std::uint32_t>(i + 1);
  }
}

void VoxelMeans::Add(const Eigen::Vector3d& point) {
  const auto key = grid_.KeyOf(point);
  if (!key) return;
  const std::size_t i = index_.Insert(*key);
  if (i == sums_.size()) {
    sums_.emplace_back(Eigen::Vector3d::Zero());
    counts_.push_back(0);
  }
  sums_[i] += point;
  ++counts_[i];
}

std::vector<Eigen::Vector3d> VoxelMeans::Means() const {
  std::vector<Eigen::Vector3d> means = sums_;
  for (std::size_t i = 0; i < means.size(); ++i) means[i] /= counts_[i];
  return means;
}

}  // namespace covsplat
