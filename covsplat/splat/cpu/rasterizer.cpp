#include "covsplat/splat/cpu/rasterizer.hpp"

#include <algorithm>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/splat/gaussian_rows.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kBlocksPerTask = 128;
constexpr std::size_t kTilesPerTask = 64;
static_assert(kTilesPerTask % kSlotGroup == 0);

}  // namespace

template <class S>
Rasterizer<S>::Rasterizer(const SensorModel& sensor, const RasterConfig& config, ThreadPool& pool)
    : pool_(pool), view_(sensor, config), binner_(pool) {
  images_.Resize(view_.Tiles());
}

template <class S>
void Rasterizer<S>::LookFrom(const SE3& T_map_sensor,
                             const GaussianColumns<S>& gaussians,
                             std::span<const AnchorRange> ranges,
                             std::span<const SE3> T_map_anchor) {
  for (const AnchorRange& range : ranges) COVSPLAT_CHECK(range.end <= gaussians.Size());
  ChooseBlocks<S>(
      T_map_sensor, static_cast<double>(view_.far_m), ranges, T_map_anchor, blocks_, transforms_);
  records_.resize(kBlockSize * blocks_.size());
  boxes_.resize(kBlockSize * blocks_.size());
  active_.resize(blocks_.size());
  for (std::size_t i = 0; i < active_.size(); ++i) active_[i] = static_cast<std::uint32_t>(i);
  Project(gaussians, true);
  binner_.Bin(view_, std::span<const SurfelRecord<S>>(records_), boxes_);
  std::erase_if(active_, [&](std::uint32_t block) {
    const auto boxes = std::span<const TileBox>(boxes_).subspan(kBlockSize * block, kBlockSize);
    return std::all_of(boxes.begin(), boxes.end(), IsEmpty);
  });
  bins_are_fresh_ = true;
}

template <class S>
void Rasterizer<S>::Project(const GaussianColumns<S>& gaussians, bool with_boxes) {
  const ProjectJob<S> job{&gaussians,
                          blocks_.data(),
                          transforms_.data(),
                          &view_,
                          records_.data(),
                          with_boxes ? boxes_.data() : nullptr};
  ParallelFor(pool_, active_.size(), kBlocksPerTask, [&](std::size_t begin, std::size_t end) {
    ProjectBlocks<S>(job, std::span<const std::uint32_t>(active_).subspan(begin, end - begin));
  });
}

template <class S>
void Rasterizer<S>::Refresh(const GaussianColumns<S>& gaussians) {
  Project(gaussians, false);
}

template <class S>
TileJob<S> Rasterizer<S>::MakeTileJob() {
  TileJob<S> job;
  job.view = &view_;
  job.records = records_.data();
  job.bins = &binner_.Bins();
  job.drop_unseen = std::exchange(bins_are_fresh_, false);
  job.images = &images_;
  return job;
}

template <class S>
void Rasterizer<S>::PrepareSlots() {
  if (!binner_.Bins().slot_begin.empty()) return;
  binner_.AssignSlots();
  const std::size_t slots = binner_.Bins().slot_begin.back();
  slots_.resize(16 * slots);
  slot_state_.resize(slots);
}

template <class S>
void Rasterizer<S>::Render() {
  const TileJob<S> job = MakeTileJob();
  ParallelFor(pool_, view_.Tiles(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    RenderTiles<S>(job, begin, end);
  });
}

template <class S>
LossSums Rasterizer<S>::RunStep(TileJob<S> job) {
  PrepareSlots();
  std::ranges::fill(slot_state_, kUnseen);
  job.slots = slots_.data();
  job.slot_state = slot_state_.data();
  return ParallelSum(
      pool_, view_.Tiles(), kTilesPerTask, LossSums{}, [&](std::size_t begin, std::size_t end) {
        return StepTiles<S>(job, begin, end);
      });
}

template <class S>
LossSums Rasterizer<S>::StepLoss(const TileTargets<S>& targets,
                                 const LossConfig& loss,
                                 const TileGradients<S>* upstream) {
  TileJob<S> job = MakeTileJob();
  job.targets = &targets;
  job.loss = &loss;
  job.upstream = upstream;
  return RunStep(job);
}

template <class S>
void Rasterizer<S>::StepUpstream(const TileGradients<S>& upstream) {
  TileJob<S> job = MakeTileJob();
  job.upstream = &upstream;
  RunStep(job);
}

template <class S>
OptimizeJob<S> Rasterizer<S>::MakeOptimizeJob(GaussianColumns<S>& gaussians) {
  OptimizeJob<S> job;
  job.gaussians = &gaussians;
  job.blocks = blocks_.data();
  job.transforms = transforms_.data();
  job.view = &view_;
  job.records = records_.data();
  job.bins = &binner_.Bins();
  job.slots = slots_.data();
  job.slot_state = slot_state_.data();
  return job;
}

template <class S>
void Rasterizer<S>::Optimize(GaussianColumns<S>& gaussians,
                             MomentColumns<S>& moments,
                             const LossConfig& loss,
                             const OptimizerConfig& optimizer) {
  OptimizeJob<S> job = MakeOptimizeJob(gaussians);
  job.moments = &moments;
  job.loss = &loss;
  job.optimizer = &optimizer;
  ParallelFor(pool_, active_.size(), kBlocksPerTask, [&](std::size_t begin, std::size_t end) {
    OptimizeBlocks<S>(job, std::span<const std::uint32_t>(active_).subspan(begin, end - begin));
  });
}

template <class S>
void Rasterizer<S>::Collect(GaussianColumns<S>& gaussians, GradientColumns<S>& gradients) {
  OptimizeJob<S> job = MakeOptimizeJob(gaussians);
  job.gradients = &gradients;
  CollectGradients<S>(job, active_);
}

template class Rasterizer<float>;
template class Rasterizer<double>;

}  // namespace covsplat
