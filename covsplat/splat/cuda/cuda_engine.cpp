#include "covsplat/splat/cuda/cuda_engine.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/splat/cuda/device_info.hpp"
#include "covsplat/splat/cuda/kernels.hpp"
#include "covsplat/splat/cuda/make_engine.hpp"
#include "covsplat/splat/gaussian_rows.hpp"
#include "covsplat/splat/surface_normals.hpp"

namespace covsplat::cuda {
namespace {

constexpr int kImagePlanes = 6;  // range, median, opacity and a normal

/// Adam's memory before the first step, column by column.
void FillFreshMoments(std::span<float> values, std::size_t rows) {
  for (int c = 0; c < kMomentCount; ++c) {
    std::fill_n(values.data() + static_cast<std::size_t>(c) * rows, rows, FreshMoment(c));
  }
}

}  // namespace

bool IsBuilt() { return true; }

Result<std::unique_ptr<SplatEngine>> MakeEngine(const SensorModel& sensor,
                                                const EngineConfig& config) {
  const Result<std::string> device = FindDevice();
  if (!device) return Forward(device);
  return std::make_unique<CudaEngine>(sensor, config, fmt::format("cuda ({})", *device));
}

CudaEngine::CudaEngine(const SensorModel& sensor, const EngineConfig& config, std::string device)
    : config_(config),
      device_(std::move(device)),
      geometry_(sensor, config.raster),
      max_range_m_(sensor.MaxRange()) {
  UploadGeometry();
  const std::size_t tiles = geometry_.Tiles();
  tile_begin_.Reserve(tiles);
  tile_end_.Reserve(tiles);
  tile_losses_.Reserve(kLossTermCount * tiles);
  surface_.Reserve(3 * kTilePixels * tiles);
  images_.Reserve(kImagePlanes * kTilePixels * tiles);
  pinned_count_.Resize(1);
  pinned_losses_.Resize(kLossTermCount);
}

CudaEngine::~CudaEngine() { cudaStreamSynchronize(stream_); }

void CudaEngine::UploadGeometry() {
  const ViewGeometry<float>& g = geometry_;
  std::vector<float> all;
  const auto add = [&](std::span<const float> table) {
    const std::size_t offset = all.size();
    all.insert(all.end(), table.begin(), table.end());
    return offset;
  };
  const std::size_t cos_azimuth = add(g.cos_azimuth);
  const std::size_t sin_azimuth = add(g.sin_azimuth);
  const std::size_t cos_elevation = add(g.cos_elevation);
  const std::size_t sin_elevation = add(g.sin_elevation);
  const std::size_t row_table = add(g.row_table);
  tables_.Upload(all, stream_);
  stream_.Wait();
  const float* base = tables_.Data();
  view_ = {.rows = g.rows,
           .columns = g.columns,
           .tile_rows = g.tile_rows,
           .tile_columns = g.tile_columns,
           .tiles = static_cast<int>(g.Tiles()),
           .cos_azimuth = base + cos_azimuth,
           .sin_azimuth = base + sin_azimuth,
           .cos_elevation = base + cos_elevation,
           .sin_elevation = base + sin_elevation,
           .row_table = base + row_table,
           .row_table_size = static_cast<int>(g.row_table.size()),
           .row_table_origin_rad = g.row_table_origin_rad,
           .row_table_samples_per_rad = g.row_table_samples_per_rad,
           .near_m = g.near_m,
           .far_m = g.far_m,
           .alpha_min = g.alpha_min,
           .alpha_cap = g.alpha_cap,
           .transmittance_min = g.transmittance_min,
           .lowpass = g.lowpass,
           .grazing_cosine = g.grazing_cosine,
           .depth_ratio = g.depth_ratio,
           .min_alpha = static_cast<float>(config_.loss.min_alpha),
           .two_sided = g.two_sided};
}

int CudaEngine::AddAnchor(const SE3& T_map_anchor) {
  T_map_anchor_.push_back(T_map_anchor);
  views_.emplace_back();
  return static_cast<int>(T_map_anchor_.size()) - 1;
}

void CudaEngine::SetAnchorPose(int anchor, const SE3& T_map_anchor) {
  T_map_anchor_[static_cast<std::size_t>(anchor)] = T_map_anchor;
  current_view_ = -1;
}

AnchorRange CudaEngine::Append(int anchor, const GaussianColumns<float>& fresh) {
  const std::size_t begin = gaussians_.Size();
  const std::size_t rows = RoundUpToBlock(fresh.Size());
  GaussianColumns<float> padded = fresh;
  padded.Resize(rows);
  MakeInert(padded, fresh.Size(), rows);
  std::span<float> values = staging_.Resize(kParameterCount * rows);
  for (int p = 0; p < kParameterCount; ++p) {
    std::copy_n(padded.Column(p), rows, values.data() + static_cast<std::size_t>(p) * rows);
  }
  gaussians_.Append(values, stream_);
  stream_.Wait();  // the staging memory is used again
  values = staging_.Resize(kMomentCount * rows);
  FillFreshMoments(values, rows);
  moments_.Append(values, stream_);
  stream_.Wait();
  host_is_current_ = false;
  current_view_ = -1;
  ranges_.push_back({anchor, begin, begin + fresh.Size()});
  return ranges_.back();
}

RowMoves CudaEngine::Keep(std::span<const std::uint8_t> keep) {
  COVSPLAT_CHECK(keep.size() == gaussians_.Size());
  KeptRows kept = KeepRows(ranges_, keep);
  std::vector<std::uint32_t> old_row(kept.moves.size);
  std::iota(old_row.begin(), old_row.end(), 0u);
  for (const RowRun& run : kept.moves.runs) {
    std::iota(old_row.begin() + static_cast<std::ptrdiff_t>(run.to),
              old_row.begin() + static_cast<std::ptrdiff_t>(run.to + run.count),
              static_cast<std::uint32_t>(run.from));
  }
  DeviceBuffer<std::uint32_t> device_old_row;
  device_old_row.Upload(old_row, stream_);
  gaussians_.Gather(device_old_row.Data(), old_row.size(), stream_);
  moments_.Gather(device_old_row.Data(), old_row.size(), stream_);
  stream_.Wait();
  ranges_ = std::move(kept.ranges);
  host_is_current_ = false;
  current_view_ = -1;
  return std::move(kept.moves);
}

const GaussianColumns<float>& CudaEngine::Gaussians() const {
  if (host_is_current_) return host_gaussians_;
  const std::size_t rows = gaussians_.Size();
  const std::span<float> values = staging_.Resize(kParameterCount * rows);
  gaussians_.Download(values, stream_);
  stream_.Wait();
  host_gaussians_.Resize(rows);
  for (int p = 0; p < kParameterCount; ++p) {
    std::copy_n(
        values.data() + static_cast<std::size_t>(p) * rows, rows, host_gaussians_.Column(p));
  }
  for (const AnchorRange& range : ranges_) {
    MakeInert(host_gaussians_, range.end, RoundUpToBlock(range.end));
  }
  MakeInert(host_gaussians_, rows, rows + kBlockSize);
  host_is_current_ = true;
  return host_gaussians_;
}

LossWeights CudaEngine::WeightsOf(const CompactView& view) const {
  const LossConfig& loss = config_.loss;
  const float per_range = 1.0f / static_cast<float>(std::max<std::size_t>(view.ValidRanges(), 1));
  const float per_normal = 1.0f / static_cast<float>(std::max<std::size_t>(view.ValidNormals(), 1));
  return {.per_range = per_range,
          .per_opacity = static_cast<float>(loss.opacity) * per_range,
          .per_normal = static_cast<float>(loss.gicp_normal) * per_normal,
          .per_surface = static_cast<float>(loss.surface_normal) * per_range,
          .range_cap_m = static_cast<float>(loss.range_cap_m),
          .opacity_epsilon = static_cast<float>(loss.opacity_epsilon),
          .hidden_factor = static_cast<float>(1.0 + loss.hidden_margin_ratio),
          .hidden_margin_m = static_cast<float>(loss.hidden_margin_m),
          .through_filter = loss.through_filter};
}

void CudaEngine::SetView(int anchor, const RangeMeasurement& measurement) {
  const CompactView compact(geometry_, max_range_m_, measurement);
  TrainingView& view = views_[static_cast<std::size_t>(anchor)];
  view.range.Upload(compact.Range(), stream_);
  view.normal.Upload(compact.Normal(), stream_);
  stream_.Wait();
  view.step_m = compact.StepM();
  view.weights = WeightsOf(compact);
  view.empty = false;
  if (current_view_ == anchor) current_view_ = -1;
}

void CudaEngine::DropView(int anchor) {
  stream_.Wait();  // for steps on it
  views_[static_cast<std::size_t>(anchor)] = TrainingView();
  if (current_view_ == anchor) current_view_ = -1;
}

SceneJob CudaEngine::Scene() {
  return {.view = view_,
          .gaussians = gaussians_.Table(),
          .blocks = device_blocks_.Data(),
          .transforms = device_transforms_.Data(),
          .records = static_cast<std::uint32_t>(kBlockSize * blocks_.size()),
          .record = records_.Data(),
          .slot_begin = slot_begin_.Data()};
}

BinJob CudaEngine::Bins() {
  return {.boxes = boxes_.Data(),
          .tile_counts = tile_counts_.Data(),
          .record_of_slot = record_of_slot_.Data(),
          .keys = keys_.Data(),
          .slots = slot_numbers_.Data(),
          .sorted_keys = sorted_keys_.Data(),
          .sorted_slots = sorted_slots_.Data(),
          .pairs = pairs_.Data(),
          .tile_begin = tile_begin_.Data(),
          .tile_end = tile_end_.Data(),
          .range_bits = RangeBits(view_.tiles)};
}

RasterJob CudaEngine::Raster() {
  return {.view = view_,
          .record = records_.Data(),
          .pairs = pairs_.Data(),
          .kept_pairs = kept_pairs_.Data(),
          .tile_begin = tile_begin_.Data(),
          .tile_end = tile_end_.Data(),
          .drop_unseen = bins_are_fresh_};
}

/// After the first pass over fresh bins: its shortened lists take the place of the sorted ones.
void CudaEngine::KeepShortLists() {
  if (std::exchange(bins_are_fresh_, false)) pairs_.Swap(kept_pairs_);
}

RenderImages CudaEngine::Images() {
  const std::size_t pixels =
      static_cast<std::size_t>(geometry_.rows) * static_cast<std::size_t>(geometry_.columns);
  float* base = images_.Data();
  return {.range_m = base,
          .median_m = base + pixels,
          .alpha = base + 2 * pixels,
          .normal = base + 3 * pixels};
}

/// Asks how much scratch memory binning needs only where it is more than before: asking takes time.
void CudaEngine::ReserveScratch(std::size_t records, std::size_t pairs) {
  if (records <= scratch_records_ && pairs <= scratch_pairs_) return;
  scratch_records_ = std::max(scratch_records_, records + records / 2);
  scratch_pairs_ = std::max(scratch_pairs_, pairs + pairs / 2);
  scratch_.Reserve(
      BinScratchBytes(static_cast<std::uint32_t>(scratch_records_), scratch_pairs_, view_.tiles));
}

/// Projects, and finds how many pairs there are: the one number that the host has to wait for.
std::uint32_t CudaEngine::FindPairs() {
  const std::size_t records = kBlockSize * blocks_.size();
  if (records == 0) return 0;
  records_.Reserve(records);
  boxes_.Reserve(records);
  tile_counts_.Reserve(records + 1);
  slot_begin_.Reserve(records + 1);
  slot_sums_.Reserve(kTilePixels * records);
  record_seen_.Reserve(records);
  ReserveScratch(records, 0);
  ProjectAll(Scene(), Bins(), stream_);
  CountPairs(Scene(), Bins(), scratch_.Data(), scratch_.Capacity(), stream_);
  CheckCuda(cudaMemcpyAsync(pinned_count_.Data(),
                            slot_begin_.Data() + records,
                            sizeof(std::uint32_t),
                            cudaMemcpyDeviceToHost,
                            stream_),
            "copying the number of pairs");
  stream_.Wait();
  return *pinned_count_.Data();
}

void CudaEngine::LookFrom(const SE3& T_map_sensor) {
  current_view_ = -1;
  stream_.Wait();  // the pinned memory is used again
  ChooseBlocks<float>(
      T_map_sensor, static_cast<double>(view_.far_m), ranges_, T_map_anchor_, blocks_, transforms_);
  device_blocks_.Upload(pinned_blocks_.Fill(blocks_), stream_);
  device_transforms_.Upload(pinned_transforms_.Fill(transforms_), stream_);
  pair_count_ = FindPairs();
  for (auto* buffer : {&record_of_slot_, &keys_, &slot_numbers_, &sorted_keys_, &sorted_slots_}) {
    buffer->Reserve(pair_count_);
  }
  pairs_.Reserve(pair_count_);
  kept_pairs_.Reserve(pair_count_);
  slots_.Reserve(kTilePixels * static_cast<std::size_t>(pair_count_));
  slot_used_.Reserve(pair_count_);
  ReserveScratch(kBlockSize * blocks_.size(), pair_count_);
  SortPairs(Scene(), Bins(), pair_count_, scratch_.Data(), scratch_.Capacity(), stream_);
  if (pair_count_ > 0) {
    CheckCuda(cudaMemsetAsync(slot_used_.Data(), 0, pair_count_, stream_), "emptying slots");
  }
  bins_are_fresh_ = true;
}

RenderOutput CudaEngine::Render(const SE3& T_map_sensor) {
  LookFrom(T_map_sensor);
  RenderTiles(Raster(), Images(), stream_);
  KeepShortLists();
  const int rows = geometry_.rows;
  const int columns = geometry_.columns;
  RenderOutput output{Image<float>(rows, columns),
                      Image<float>(rows, columns),
                      Image<float>(rows, columns),
                      Image<Eigen::Vector3f>(rows, columns, Eigen::Vector3f::Zero())};
  const std::size_t pixels = output.alpha.Size();
  const std::span<float> values = pinned_images_.Resize(kImagePlanes * pixels);
  CheckCuda(
      cudaMemcpyAsync(
          values.data(), images_.Data(), values.size_bytes(), cudaMemcpyDeviceToHost, stream_),
      "copying a rendering");
  stream_.Wait();
  std::copy_n(values.data(), pixels, output.range_m.Pixels().data());
  std::copy_n(values.data() + pixels, pixels, output.median_range_m.Pixels().data());
  std::copy_n(values.data() + 2 * pixels, pixels, output.alpha.Pixels().data());
  const float* normal = values.data() + 3 * pixels;
  for (Eigen::Vector3f& pixel : output.normal.Pixels()) {
    pixel = Eigen::Vector3f(normal[0], normal[1], normal[2]);
    normal += 3;
  }
  return output;
}

// Binning and the surface normals serve several steps on the same view.
void CudaEngine::BeginView(int anchor, bool surface_normals) {
  const auto index = static_cast<std::size_t>(anchor);
  COVSPLAT_CHECK(!views_[index].empty);
  LookFrom(T_map_anchor_[index]);
  surface_is_on_ = surface_normals && config_.loss.surface_normal > 0.0;
  if (surface_is_on_) {
    RenderTiles(Raster(), Images(), stream_);
    KeepShortLists();
    FindSurfaceNormals(view_,
                       kMaxRelativeStep,
                       Images().range_m,
                       views_[index].range.Data(),
                       surface_.Data(),
                       stream_);
  }
  current_view_ = anchor;
  steps_left_ = config_.raster.rebin_interval;
}

AdamRates CudaEngine::Rates() const {
  const OptimizerConfig& c = config_.optimizer;
  return {.mean_step_m = static_cast<float>(c.mean_step_m),
          .rotation_step_rad = static_cast<float>(c.rotation_step_rad),
          .log_scale_step = static_cast<float>(c.log_scale_step),
          .opacity_logit_step = static_cast<float>(c.opacity_logit_step),
          .beta1 = static_cast<float>(c.beta1),
          .beta2 = static_cast<float>(c.beta2),
          .epsilon = static_cast<float>(c.epsilon),
          .scale_weight = static_cast<float>(config_.loss.scale),
          .max_scale_m = static_cast<float>(config_.loss.max_scale_m),
          .max_log_growth = static_cast<float>(std::log(config_.optimizer.max_growth)),
          .mean_along_normal = c.mean_along_normal};
}

StepReport CudaEngine::Step(int anchor, bool surface_normals) {
  if (current_view_ != anchor || steps_left_ == 0) {
    BeginView(anchor, surface_normals);
  }
  --steps_left_;
  TrainingView& view = views_[static_cast<std::size_t>(anchor)];
  const StepJob job{.raster = Raster(),
                    .targets = {.range = view.range.Data(),
                                .normal = view.normal.Data(),
                                .range_step_m = view.step_m,
                                .surface = surface_is_on_ ? surface_.Data() : nullptr},
                    .weights = view.weights,
                    .slots = slots_.Data(),
                    .slot_used = slot_used_.Data(),
                    .tile_losses = tile_losses_.Data()};
  StepTiles(job, pinned_losses_.Data(), stream_);
  KeepShortLists();
  losses_are_known_.Record(stream_);
  Optimize({.scene = Scene(),
            .moments = moments_.Table(),
            .rates = Rates(),
            .slots = slots_.Data(),
            .slot_used = slot_used_.Data(),
            .slot_sums = slot_sums_.Data(),
            .record_seen = record_seen_.Data()},
           stream_);
  host_is_current_ = false;
  losses_are_known_.Wait();  // the device goes on with Adam meanwhile
  const double* losses = pinned_losses_.Data();
  return {losses[kLossRange], losses[kLossOpacity], losses[kLossNormal], pair_count_};
}

}  // namespace covsplat::cuda
