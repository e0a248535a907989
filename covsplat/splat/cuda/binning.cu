// Binning: pairs of Gaussians and tiles, sorted by tile and range, become the tiles' lists.
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "covsplat/splat/cuda/device_math.cuh"
#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

constexpr int kThreads = 256;
constexpr int kRangeKeyBits = 22;  // as the CPU's: 0.03 mm at 120 m

__device__ int WrapTile(int x, int tile_columns) {
  return x < 0 ? x + tile_columns : x >= tile_columns ? x - tile_columns : x;
}

__global__ void EmitPairsKernel(SceneJob scene, BinJob bins) {
  const std::uint32_t r = blockIdx.x * kThreads + threadIdx.x;
  if (r >= scene.records) return;
  const TileBox box = bins.boxes[r];
  if (box.x1 < box.x0) return;
  const float keys_per_m = static_cast<float>((1u << kRangeKeyBits) - 1) / scene.view.far_m;
  const auto range_key = static_cast<std::uint32_t>(scene.record[r].range * keys_per_m);
  std::uint32_t slot = scene.slot_begin[r];
  for (int y = box.y0; y <= box.y1; ++y) {
    for (int x = box.x0; x <= box.x1; ++x, ++slot) {
      const auto tile = static_cast<std::uint64_t>(y * scene.view.tile_columns +
                                                   WrapTile(x, scene.view.tile_columns));
      bins.keys[slot] = tile << kRangeKeyBits | range_key;
      bins.unsorted[slot] = {r, slot};
    }
  }
}

/// Where the tile changes between neighbours in the sorted list, one list ends and one begins.
__global__ void FindListsKernel(BinJob bins, std::uint32_t pairs) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= pairs) return;
  const auto tile = static_cast<std::uint32_t>(bins.sorted_keys[i] >> kRangeKeyBits);
  const auto before =
      i == 0 ? ~0u : static_cast<std::uint32_t>(bins.sorted_keys[i - 1] >> kRangeKeyBits);
  if (tile != before) {
    bins.tile_begin[tile] = i;
    if (i > 0) bins.tile_end[before] = i;
  }
  if (i + 1 == pairs) bins.tile_end[tile] = pairs;
}

int KeyBits(int tiles) {
  int bits = kRangeKeyBits;
  while (tiles > 1 << (bits - kRangeKeyBits)) ++bits;
  return bits;
}

}  // namespace

std::size_t BinScratchBytes(std::uint32_t records, std::size_t pairs, int tiles) {
  std::size_t scan = 0;
  std::size_t sort = 0;
  const std::uint32_t* counts = nullptr;
  std::uint32_t* sums = nullptr;
  const std::uint64_t* keys = nullptr;
  std::uint64_t* sorted_keys = nullptr;
  const TilePair* values = nullptr;
  TilePair* sorted = nullptr;
  CheckCuda(cub::DeviceScan::ExclusiveSum(nullptr, scan, counts, sums, records + 1),
            "sizing the scan");
  CheckCuda(cub::DeviceRadixSort::SortPairs(
                nullptr, sort, keys, sorted_keys, values, sorted, pairs, 0, KeyBits(tiles)),
            "sizing the sort");
  return std::max(scan, sort);
}

void CountPairs(const SceneJob& scene,
                const BinJob& bins,
                void* scratch,
                std::size_t bytes,
                cudaStream_t stream) {
  const std::uint32_t* counts = bins.tile_counts;
  CheckCuda(cub::DeviceScan::ExclusiveSum(
                scratch, bytes, counts, scene.slot_begin, scene.records + 1, stream),
            "counting pairs");
}

void SortPairs(const SceneJob& scene,
               const BinJob& bins,
               std::size_t pairs,
               void* scratch,
               std::size_t bytes,
               cudaStream_t stream) {
  const std::size_t tiles = static_cast<std::size_t>(scene.view.tiles);
  const std::size_t list_bytes = tiles * sizeof(std::uint32_t);
  CheckCuda(cudaMemsetAsync(bins.tile_begin, 0, list_bytes, stream), "emptying lists");
  CheckCuda(cudaMemsetAsync(bins.tile_end, 0, list_bytes, stream), "emptying lists");
  if (pairs == 0) return;
  EmitPairsKernel<<<CeilDivide(scene.records, kThreads), kThreads, 0, stream>>>(scene, bins);
  CheckLaunch("listing pairs");
  const std::uint64_t* keys = bins.keys;
  const TilePair* values = bins.unsorted;
  CheckCuda(cub::DeviceRadixSort::SortPairs(scratch,
                                            bytes,
                                            keys,
                                            bins.sorted_keys,
                                            values,
                                            bins.pairs,
                                            pairs,
                                            0,
                                            KeyBits(scene.view.tiles),
                                            stream),
            "sorting pairs");
  FindListsKernel<<<CeilDivide(pairs, kThreads), kThreads, 0, stream>>>(
      bins, static_cast<std::uint32_t>(pairs));
  CheckLaunch("finding lists");
}

}  // namespace covsplat::cuda
