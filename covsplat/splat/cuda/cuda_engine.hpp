// CudaEngine: the backend on a CUDA device.
#pragma once

#include <string>

#include "covsplat/splat/compact_view.hpp"
#include "covsplat/splat/cuda/device_columns.hpp"
#include "covsplat/splat/engine.hpp"

namespace covsplat::cuda {

/// Does what CpuEngine does, on the device. Gaussians, the optimiser's memory and the training
/// views live there; the host keeps where they are. Results are the same bits every time. Like the
/// CPU, bins serve several steps and lose, in the first, the pairs that no pixel sees.
class CudaEngine final : public SplatEngine {
 public:
  CudaEngine(const SensorModel& sensor, const EngineConfig& config, std::string device);
  ~CudaEngine() override;

  std::string Device() const override { return device_; }
  int AddAnchor(const SE3& T_map_anchor) override;
  void SetAnchorPose(int anchor, const SE3& T_map_anchor) override;
  const std::vector<SE3>& AnchorPoses() const override { return T_map_anchor_; }
  AnchorRange Append(int anchor, const GaussianColumns<float>& fresh) override;
  RowMoves Keep(std::span<const std::uint8_t> keep) override;
  /// Copies from the device, once after each change.
  const GaussianColumns<float>& Gaussians() const override;
  const std::vector<AnchorRange>& Ranges() const override { return ranges_; }
  void SetView(int anchor, const RangeMeasurement& measurement) override;
  void DropView(int anchor) override;
  RenderOutput Render(const SE3& T_map_sensor) override;
  StepReport Step(int anchor, bool surface_normals) override;

 private:
  struct TrainingView {
    DeviceBuffer<std::uint16_t> range;
    DeviceBuffer<std::int8_t> normal;
    float step_m = 0.0f;
    LossWeights weights = {};
    bool empty = true;
  };

  void UploadGeometry();
  LossWeights WeightsOf(const CompactView& view) const;
  AdamRates Rates() const;
  void LookFrom(const SE3& T_map_sensor);
  std::uint32_t FindPairs();
  void ReserveScratch(std::size_t records, std::size_t pairs);
  void BeginView(int anchor, bool surface_normals);
  SceneJob Scene();
  BinJob Bins();
  RasterJob Raster();
  void KeepShortLists();
  RenderImages Images();

  const EngineConfig config_;
  const std::string device_;
  const ViewGeometry<float> geometry_;
  const double max_range_m_;
  Stream stream_;
  Event losses_are_known_;

  std::vector<SE3> T_map_anchor_;
  std::vector<AnchorRange> ranges_;
  std::vector<TrainingView> views_;  ///< [anchors]
  DeviceColumns gaussians_{kParameterCount};
  DeviceColumns moments_{kMomentCount};
  mutable GaussianColumns<float> host_gaussians_;
  mutable bool host_is_current_ = true;
  mutable PinnedBuffer<float> staging_;

  // The view at hand. The shapes are those of the jobs in device_data.hpp.
  DeviceBuffer<float> tables_;
  DeviceView view_ = {};
  std::vector<GaussianBlock> blocks_;
  std::vector<AnchorTransform<float>> transforms_;
  PinnedBuffer<GaussianBlock> pinned_blocks_;
  PinnedBuffer<AnchorTransform<float>> pinned_transforms_;
  DeviceBuffer<GaussianBlock> device_blocks_;
  DeviceBuffer<AnchorTransform<float>> device_transforms_;
  DeviceBuffer<SurfelRecord<float>> records_;
  DeviceBuffer<TileBox> boxes_;
  DeviceBuffer<std::uint32_t> tile_counts_, slot_begin_, tile_begin_, tile_end_;
  DeviceBuffer<std::uint32_t> keys_, sorted_keys_, slot_numbers_, sorted_slots_, record_of_slot_;
  DeviceBuffer<TilePair> pairs_, kept_pairs_;
  DeviceBuffer<char> scratch_;
  std::size_t scratch_records_ = 0, scratch_pairs_ = 0;  ///< that the scratch memory is enough for
  DeviceBuffer<float> slots_, slot_sums_;
  DeviceBuffer<std::uint8_t> slot_used_, record_seen_;
  DeviceBuffer<float> images_, surface_, tile_losses_;
  PinnedBuffer<std::uint32_t> pinned_count_;
  PinnedBuffer<double> pinned_losses_;
  PinnedBuffer<float> pinned_images_;
  std::uint32_t pair_count_ = 0;
  bool bins_are_fresh_ = false;  ///< no pass has dropped what is not seen yet
  bool surface_is_on_ = false;

  // The training view whose bins and surface normals are at hand, and for how many more steps.
  int current_view_ = -1;
  int steps_left_ = 0;
};

}  // namespace covsplat::cuda
