// CpuEngine: the default backend, on any CPU.
#pragma once

#include <string>

#include "covsplat/splat/compact_view.hpp"
#include "covsplat/splat/cpu/rasterizer.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat {

class CpuEngine final : public SplatEngine {
 public:
  /// `device`: what Device() says.
  CpuEngine(const SensorModel& sensor,
            const EngineConfig& config,
            std::string device,
            ThreadPool& pool);

  std::string Device() const override { return device_; }
  int AddAnchor(const SE3& T_map_anchor) override;
  void SetAnchorPose(int anchor, const SE3& T_map_anchor) override;
  const std::vector<SE3>& AnchorPoses() const override { return T_map_anchor_; }
  AnchorRange Append(int anchor, const GaussianColumns<float>& fresh) override;
  RowMoves Keep(std::span<const std::uint8_t> keep) override;
  const GaussianColumns<float>& Gaussians() const override { return gaussians_; }
  const std::vector<AnchorRange>& Ranges() const override { return ranges_; }
  void SetView(int anchor, const RangeMeasurement& measurement) override;
  void DropView(int anchor) override;
  RenderOutput Render(const SE3& T_map_sensor) override;
  StepReport Step(int anchor, bool surface_normals) override;

 private:
  void LookFrom(const SE3& T_map_sensor);
  void BeginView(int anchor, bool surface_normals);
  void ResizeTables(std::size_t size);

  const SensorModel sensor_;
  const EngineConfig config_;
  const std::string device_;
  ThreadPool& pool_;
  Rasterizer<float> rasterizer_;

  std::vector<SE3> T_map_anchor_;
  std::vector<CompactView> views_;  ///< [anchors]
  GaussianColumns<float> gaussians_;
  MomentColumns<float> moments_;
  std::vector<AnchorRange> ranges_;

  // The view whose bins and measurements are at hand, and for how many more steps they serve.
  int current_view_ = -1;
  int steps_left_ = 0;
  TileTargets<float> targets_;
};

}  // namespace covsplat
