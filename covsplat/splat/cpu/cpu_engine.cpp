#include "covsplat/splat/cpu/cpu_engine.hpp"

#include <algorithm>
#include <utility>

#include "covsplat/core/check.hpp"
#include "covsplat/splat/gaussian_rows.hpp"
#include "covsplat/splat/surface_normals.hpp"

namespace covsplat {
namespace {

void ResetMoments(MomentColumns<float>& moments, std::size_t begin, std::size_t end) {
  for (int c = 0; c < kMomentCount; ++c) {
    std::fill(moments.Column(c) + begin, moments.Column(c) + end, FreshMoment(c));
  }
}

}  // namespace

CpuEngine::CpuEngine(const SensorModel& sensor,
                     const EngineConfig& config,
                     std::string device,
                     ThreadPool& pool)
    : sensor_(sensor),
      config_(config),
      device_(std::move(device)),
      pool_(pool),
      rasterizer_(sensor, config.raster, pool) {}

int CpuEngine::AddAnchor(const SE3& T_map_anchor) {
  T_map_anchor_.push_back(T_map_anchor);
  views_.emplace_back();
  return static_cast<int>(T_map_anchor_.size()) - 1;
}

void CpuEngine::SetAnchorPose(int anchor, const SE3& T_map_anchor) {
  T_map_anchor_[static_cast<std::size_t>(anchor)] = T_map_anchor;
  current_view_ = -1;
}

void CpuEngine::ResizeTables(std::size_t size) {
  const std::size_t old_size = gaussians_.Size();
  gaussians_.Resize(size);
  moments_.Resize(size);
  const std::size_t begin = std::min(old_size, size);
  MakeInert(gaussians_, begin, size + kBlockSize);
  ResetMoments(moments_, begin, size + kBlockSize);
  current_view_ = -1;
}

AnchorRange CpuEngine::Append(int anchor, const GaussianColumns<float>& fresh) {
  const std::size_t begin = gaussians_.Size();
  ResizeTables(begin + RoundUpToBlock(fresh.Size()));
  for (int p = 0; p < kParameterCount; ++p) {
    std::copy_n(fresh.Column(p), fresh.Size(), gaussians_.Column(p) + begin);
  }
  ranges_.push_back({anchor, begin, begin + fresh.Size()});
  return ranges_.back();
}

RowMoves CpuEngine::Keep(std::span<const std::uint8_t> keep) {
  COVSPLAT_CHECK(keep.size() == gaussians_.Size());
  KeptRows kept = KeepRows(ranges_, keep);
  gaussians_.Move(kept.moves);
  moments_.Move(kept.moves);
  ranges_ = std::move(kept.ranges);
  for (const AnchorRange& range : ranges_) {
    MakeInert(gaussians_, range.end, RoundUpToBlock(range.end));
  }
  ResizeTables(kept.moves.size);
  return std::move(kept.moves);
}

void CpuEngine::SetView(int anchor, const RangeMeasurement& measurement) {
  views_[static_cast<std::size_t>(anchor)] =
      CompactView(rasterizer_.View(), sensor_.MaxRange(), measurement);
  if (current_view_ == anchor) current_view_ = -1;
}

void CpuEngine::DropView(int anchor) {
  views_[static_cast<std::size_t>(anchor)] = CompactView();
  if (current_view_ == anchor) current_view_ = -1;
}

void CpuEngine::LookFrom(const SE3& T_map_sensor) {
  current_view_ = -1;
  rasterizer_.LookFrom(T_map_sensor, gaussians_, ranges_, T_map_anchor_);
}

RenderOutput CpuEngine::Render(const SE3& T_map_sensor) {
  LookFrom(T_map_sensor);
  rasterizer_.Render();
  const ViewGeometry<float>& view = rasterizer_.View();
  const TileImages<float>& images = rasterizer_.Images();
  RenderOutput output{Image<float>(view.rows, view.columns, 0.0f),
                      Image<float>(view.rows, view.columns, 0.0f),
                      Image<float>(view.rows, view.columns, 0.0f),
                      Image<Eigen::Vector3f>(view.rows, view.columns, Eigen::Vector3f::Zero())};
  const auto min_alpha = static_cast<float>(config_.loss.min_alpha);
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      const std::size_t i = PixelIndex(view, row, column);
      const float alpha = 1.0f - images.transmittance[i];
      output.alpha(row, column) = alpha;
      if (alpha < min_alpha) continue;
      const float expected = images.range_sum[i] / alpha;
      output.range_m(row, column) = expected + view.depth_ratio * (images.median[i] - expected);
      output.median_range_m(row, column) = images.median[i];
      output.normal(row, column) =
          Eigen::Vector3f(images.normal_x[i], images.normal_y[i], images.normal_z[i]).normalized();
    }
  }
  return output;
}

// Binning, the measurements and the surface normals serve several steps on the same view.
void CpuEngine::BeginView(int anchor, bool surface_normals) {
  const auto index = static_cast<std::size_t>(anchor);
  COVSPLAT_CHECK(!views_[index].Empty());
  views_[index].Expand(targets_);
  LookFrom(T_map_anchor_[index]);
  if (surface_normals && config_.loss.surface_normal > 0.0) {
    rasterizer_.Render();
    FindSurfaceNormals(
        rasterizer_.View(), rasterizer_.Images(), config_.loss.min_alpha, pool_, targets_);
  }
  current_view_ = anchor;
  steps_left_ = config_.raster.rebin_interval;
}

StepReport CpuEngine::Step(int anchor, bool surface_normals) {
  if (current_view_ != anchor || steps_left_ == 0) {
    BeginView(anchor, surface_normals);
  } else {
    rasterizer_.Refresh(gaussians_);
  }
  --steps_left_;
  const LossSums sums = rasterizer_.StepLoss(targets_, config_.loss, nullptr);
  rasterizer_.Optimize(gaussians_, moments_, config_.loss, config_.optimizer);
  return {sums.range, sums.opacity, sums.normal, rasterizer_.Pairs()};
}

}  // namespace covsplat
