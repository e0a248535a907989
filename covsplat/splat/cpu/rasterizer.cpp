#include "covsplat/splat/cpu/rasterizer.hpp"

#include <algorithm>
#include <utility>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

constexpr std::size_t kBlocksPerTask = 128;
constexpr std::size_t kTilesPerTask = 64;

template <class S>
AnchorTransform<S> ToTransform(const SE3& T_sensor_anchor) {
  AnchorTransform<S> transform;
  const Eigen::Matrix3d rotation = T_sensor_anchor.RotationMatrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) transform.rotation[3 * i + j] = static_cast<S>(rotation(i, j));
    transform.translation[i] = static_cast<S>(T_sensor_anchor.Translation()[i]);
  }
  return transform;
}

}  // namespace

template <class S>
Rasterizer<S>::Rasterizer(const SensorModel& sensor, const RasterConfig& config, ThreadPool& pool)
    : pool_(pool), view_(sensor, config) {
  images_.Resize(view_.Tiles());
}

template <class S>
void Rasterizer<S>::LookFrom(const SE3& T_map_sensor,
                             const GaussianColumns<S>& gaussians,
                             std::span<const AnchorRange> ranges,
                             std::span<const SE3> T_map_anchor) {
  ChooseBlocks(T_map_sensor, gaussians, ranges, T_map_anchor);
  records_.resize(kBlockSize * blocks_.size());
  boxes_.resize(kBlockSize * blocks_.size());
  active_.resize(blocks_.size());
  for (std::size_t i = 0; i < active_.size(); ++i) active_[i] = static_cast<std::uint32_t>(i);
  Project(gaussians, true);
  binner_.Bin(view_, std::span<const SurfelRecord<S>>(records_), boxes_);
  const auto is_visible = [&](std::uint32_t block) {
    const std::vector<std::uint32_t>& begin = binner_.Bins().slot_begin;
    return begin[kBlockSize * block] < begin[kBlockSize * (block + 1)];
  };
  std::erase_if(active_, [&](std::uint32_t block) { return !is_visible(block); });
  slots_.resize(16 * Pairs());
  slot_used_.assign(Pairs(), 0);
  bins_are_fresh_ = true;
}

// Anchors out of reach of the sensor cannot have visible Gaussians: a Gaussian is at most the
// sensor's range from its anchor, and the far limit holds at the view.
template <class S>
void Rasterizer<S>::ChooseBlocks(const SE3& T_map_sensor,
                                 const GaussianColumns<S>& gaussians,
                                 std::span<const AnchorRange> ranges,
                                 std::span<const SE3> T_map_anchor) {
  blocks_.clear();
  transforms_.clear();
  const SE3 T_sensor_map = T_map_sensor.Inverse();
  for (const AnchorRange& range : ranges) {
    const SE3 T_sensor_anchor = T_sensor_map * T_map_anchor[static_cast<std::size_t>(range.anchor)];
    if (T_sensor_anchor.Translation().norm() > 2.0 * static_cast<double>(view_.far_m)) continue;
    const auto transform = static_cast<std::uint16_t>(transforms_.size());
    transforms_.push_back(ToTransform<S>(T_sensor_anchor));
    COVSPLAT_CHECK(range.end <= gaussians.Size() && range.begin % kBlockSize == 0);
    COVSPLAT_CHECK(transforms_.size() < 65536);
    for (std::size_t begin = range.begin; begin < range.end; begin += kBlockSize) {
      const std::size_t count = std::min(kBlockSize, range.end - begin);
      blocks_.push_back(
          {static_cast<std::uint32_t>(begin), static_cast<std::uint16_t>(count), transform});
    }
  }
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
  job.slots = slots_.data();
  job.slot_used = slot_used_.data();
  return job;
}

template <class S>
void Rasterizer<S>::Render() {
  const TileJob<S> job = MakeTileJob();
  ParallelFor(pool_, view_.Tiles(), kTilesPerTask, [&](std::size_t begin, std::size_t end) {
    RenderTiles<S>(job, begin, end);
  });
}

template <class S>
LossSums Rasterizer<S>::RunStep(const TileJob<S>& job) {
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
  job.slot_used = slot_used_.data();
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
