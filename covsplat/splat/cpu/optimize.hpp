// From gradient slots to parameters: the chain rule of each Gaussian, and Adam.
#pragma once

#include "covsplat/splat/cpu/project.hpp"

namespace covsplat {

template <class S>
using MomentColumns = ColumnTable<S, kMomentCount>;

/// Gradient with respect to the tangent of each Gaussian.
template <class S>
using GradientColumns = ColumnTable<S, kTangentCount>;

template <class S>
struct OptimizeJob {
  GaussianColumns<S>* gaussians = nullptr;
  const GaussianBlock* blocks = nullptr;
  const AnchorTransform<S>* transforms = nullptr;
  const ViewGeometry<S>* view = nullptr;
  const SurfelRecord<S>* records = nullptr;
  const TileBins* bins = nullptr;
  const S* slots = nullptr;
  const SlotState* slot_state = nullptr;

  // Optimising: moments, loss (for the scale term) and steps. Gradients only: `gradients`.
  MomentColumns<S>* moments = nullptr;
  const LossConfig* loss = nullptr;
  const OptimizerConfig* optimizer = nullptr;
  GradientColumns<S>* gradients = nullptr;
};

/// Sums each Gaussian's slots in order and takes one Adam step with those that some pixel saw; all
/// others stay as they are. Clears `slot_state`.
template <class S>
void OptimizeBlocks(const OptimizeJob<S>& job, std::span<const std::uint32_t> block_numbers);

/// Writes the gradients of the blocks' Gaussians to `job.gradients`. Clears `slot_state`.
template <class S>
void CollectGradients(const OptimizeJob<S>& job, std::span<const std::uint32_t> block_numbers);

}  // namespace covsplat
