// The kernels, as the host sees them. Every function puts its work into the stream and returns.
#pragma once

#include <cuda_runtime_api.h>

#include "covsplat/splat/cuda/device_data.hpp"

namespace covsplat::cuda {

/// Whether this build has code for the current device.
cudaError_t CheckKernels();

/// Projects all records and finds their boxes, numbers of pairs and ranges.
void ProjectAll(const SceneJob& scene, const BinJob& bins, cudaStream_t stream);

/// How many bits of a pair's key are left for the range.
int RangeBits(int tiles);
/// Scratch memory that the two functions below need for so many records and pairs.
std::size_t BinScratchBytes(std::uint32_t records, std::size_t pairs, int tiles);
/// From the records' numbers of pairs to `slot_begin`, whose last entry is the number of pairs.
void CountPairs(const SceneJob& scene,
                const BinJob& bins,
                void* scratch,
                std::size_t bytes,
                cudaStream_t stream);
/// Sorts the pairs by tile, then by the range of their Gaussians' centres (ties by record), and
/// finds each tile's list.
void SortPairs(const SceneJob& scene,
               const BinJob& bins,
               std::size_t pairs,
               void* scratch,
               std::size_t bytes,
               cudaStream_t stream);

void RenderTiles(const RasterJob& job, const RenderImages& images, cudaStream_t stream);
/// Normals of a rendering at the pixels that were measured, tile by tile: as FindSurfaceNormals.
void FindSurfaceNormals(const DeviceView& view,
                        float max_relative_step,
                        const float* range_m,
                        const std::uint16_t* measured,
                        float* surface,
                        cudaStream_t stream);
/// Blends, evaluates the loss and leaves its gradient in the slots, and its terms in `sums`
/// [kLossTermCount] in double.
void StepTiles(const StepJob& job, double* sums, cudaStream_t stream);

/// Each Gaussian that some pixel saw adds up its slots, applies the chain rule, takes one step of
/// Adam and is projected again.
void Optimize(const OptimizeJob& job, cudaStream_t stream);

/// Row i of `to` becomes row old_row[i] of `from`.
void GatherRows(const DeviceTable& from,
                int columns,
                const std::uint32_t* old_row,
                std::size_t rows,
                const DeviceTable& to,
                cudaStream_t stream);

}  // namespace covsplat::cuda
