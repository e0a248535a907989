// Rasterizer: the CPU stages put together for one view of one table of Gaussians.
#pragma once

#include "covsplat/core/parallel.hpp"
#include "covsplat/splat/cpu/binning.hpp"
#include "covsplat/splat/cpu/optimize.hpp"
#include "covsplat/splat/cpu/rasterize.hpp"

namespace covsplat {

/// Usage: LookFrom a pose, then Render, or any number of StepLoss and Optimize (or Collect), with
/// Refresh after every change of parameters. Bins stay as they were at LookFrom, less the pairs
/// that the first pass over the tiles did not see. Results are the same bits for any number of
/// threads. S is float, or double in tests.
template <class S>
class Rasterizer {
 public:
  Rasterizer(const SensorModel& sensor, const RasterConfig& config, ThreadPool& pool);

  /// Chooses the Gaussians in reach, projects and bins them. `T_map_anchor` is indexed by anchor.
  void LookFrom(const SE3& T_map_sensor,
                const GaussianColumns<S>& gaussians,
                std::span<const AnchorRange> ranges,
                std::span<const SE3> T_map_anchor);

  /// Projects again after parameters changed; the table must not have grown or shrunk.
  void Refresh(const GaussianColumns<S>& gaussians);

  void Render();

  /// Renders, and leaves the gradient of the loss plus `upstream` (may be null) for Optimize or
  /// Collect.
  LossSums StepLoss(const TileTargets<S>& targets,
                    const LossConfig& loss,
                    const TileGradients<S>* upstream);
  /// Renders, and leaves the gradient of <upstream, images>.
  void StepUpstream(const TileGradients<S>& upstream);

  void Optimize(GaussianColumns<S>& gaussians,
                MomentColumns<S>& moments,
                const LossConfig& loss,
                const OptimizerConfig& optimizer);
  /// Writes the gradients of the Gaussians that some pixel saw.
  void Collect(GaussianColumns<S>& gaussians, GradientColumns<S>& gradients);

  const ViewGeometry<S>& View() const { return view_; }
  const TileImages<S>& Images() const { return images_; }
  /// (Gaussian, tile) pairs of the current bins: the size of the work.
  std::size_t Pairs() const { return binner_.Bins().pairs.size(); }
  /// Those of them that are left in the tiles' lists: once a gradient was made, what pixels see.
  std::size_t ListedPairs() const { return binner_.Bins().ListedPairs(); }
  std::size_t Slots() const { return slot_state_.size(); }
  std::size_t ActiveBlocks() const { return active_.size(); }

 private:
  void Project(const GaussianColumns<S>& gaussians, bool with_boxes);
  TileJob<S> MakeTileJob();
  /// Gives the pairs their slots where they have none.
  void PrepareSlots();
  LossSums RunStep(TileJob<S> job);
  OptimizeJob<S> MakeOptimizeJob(GaussianColumns<S>& gaussians);

  ThreadPool& pool_;
  const ViewGeometry<S> view_;

  std::vector<GaussianBlock> blocks_;
  std::vector<AnchorTransform<S>> transforms_;
  std::vector<std::uint32_t> active_;  ///< numbers of the blocks with a visible Gaussian
  std::vector<SurfelRecord<S>> records_;
  std::vector<TileBox> boxes_;
  TileBinner binner_;
  TileImages<S> images_;
  AlignedVector<S> slots_;
  std::vector<SlotState> slot_state_;
  bool bins_are_fresh_ = false;  ///< no pass has dropped what is not seen yet
};

}  // namespace covsplat
