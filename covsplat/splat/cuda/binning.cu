// Binning: pairs of Gaussians and tiles, sorted by tile and range, become the tiles' lists.
#include <algorithm>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "covsplat/splat/cuda/device_math.cuh"
#include "covsplat/splat/cuda/kernels.hpp"

namespace covsplat::cuda {
namespace {

constexpr int kThreads = 256;
constexpr int kKeyBits = 32;
constexpr int kMostRangeBits = 22;  // as the CPU's: 0.03 mm at 120 m; 0.1 mm with 4096 tiles

__device__ int WrapTile(int x, int tile_columns) {
  return x < 0 ? x + tile_columns : x >= tile_columns ? x - tile_columns : x;
}

__global__ void EmitPairsKernel(SceneJob scene, BinJob bins) {
  const std::uint32_t r = blockIdx.x * kThreads + threadIdx.x;
  if (r >= scene.records) return;
  const TileBox box = bins.boxes[r];
  if (box.x1 < box.x0) return;
  const float keys_per_m = static_cast<float>((1u << bins.range_bits) - 1) / scene.view.far_m;
  const auto range_key = static_cast<std::uint32_t>(scene.record[r].range * keys_per_m);
  std::uint32_t slot = scene.slot_begin[r];
  for (int y = box.y0; y <= box.y1; ++y) {
    for (int x = box.x0; x <= box.x1; ++x, ++slot) {
      const int tile = y * scene.view.tile_columns + WrapTile(x, scene.view.tile_columns);
      bins.keys[slot] = static_cast<std::uint32_t>(tile) << bins.range_bits | range_key;
      bins.slots[slot] = slot;
      bins.record_of_slot[slot] = r;
    }
  }
}

/// Looks up the records of the sorted slots. Where the tile changes between neighbours, one list
/// ends and one begins.
__global__ void FindListsKernel(BinJob bins, std::uint32_t pairs) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= pairs) return;
  const std::uint32_t slot = bins.sorted_slots[i];
  bins.pairs[i] = {bins.record_of_slot[slot], slot};
  const std::uint32_t tile = bins.sorted_keys[i] >> bins.range_bits;
  const std::uint32_t before = i == 0 ? ~0u : bins.sorted_keys[i - 1] >> bins.range_bits;
  if (tile != before) {
    bins.tile_begin[tile] = i;
    if (i > 0) bins.tile_end[before] = i;
  }
  if (i + 1 == pairs) bins.tile_end[tile] = pairs;
}

int TileBits(int tiles) {
  int bits = 0;
  while (tiles > 1 << bits) ++bits;
  return bits;
}

}  // namespace

int RangeBits(int tiles) { return std::min(kMostRangeBits, kKeyBits - TileBits(tiles)); }

std::size_t BinScratchBytes(std::uint32_t records, std::size_t pairs, int tiles) {
  std::size_t scan = 0;
  std::size_t sort = 0;
  const std::uint32_t* in = nullptr;
  std::uint32_t* out = nullptr;
  CheckCuda(cub::DeviceScan::ExclusiveSum(nullptr, scan, in, out, records + 1), "sizing the scan");
  CheckCuda(cub::DeviceRadixSort::SortPairs(
                nullptr, sort, in, out, in, out, pairs, 0, RangeBits(tiles) + TileBits(tiles)),
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
  const std::uint32_t* keys = bins.keys;
  const std::uint32_t* slots = bins.slots;
  CheckCuda(cub::DeviceRadixSort::SortPairs(scratch,
                                            bytes,
                                            keys,
                                            bins.sorted_keys,
                                            slots,
                                            bins.sorted_slots,
                                            pairs,
                                            0,
                                            bins.range_bits + TileBits(scene.view.tiles),
                                            stream),
            "sorting pairs");
  FindListsKernel<<<CeilDivide(pairs, kThreads), kThreads, 0, stream>>>(
      bins, static_cast<std::uint32_t>(pairs));
  CheckLaunch("finding lists");
}

}  // namespace covsplat::cuda
