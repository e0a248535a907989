// SplatEngine: the only door to a backend that holds, renders and improves Gaussians.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "covsplat/core/image.hpp"
#include "covsplat/core/parallel.hpp"
#include "covsplat/core/result.hpp"
#include "covsplat/core/se3.hpp"
#include "covsplat/core/sensor_model.hpp"
#include "covsplat/splat/gaussians.hpp"
#include "covsplat/splat/splat_config.hpp"

namespace covsplat {

enum class Backend { kAuto, kCpu, kCuda };

template <>
struct EnumNames<Backend> {
  static constexpr std::array<EnumName<Backend>, 3> kNames{
      {{Backend::kAuto, "auto"}, {Backend::kCpu, "cpu"}, {Backend::kCuda, "cuda"}}};
};

/// What a keyframe measured, on the sensor's image grid. Range 0: no return. Normal 0: unknown.
struct RangeMeasurement {
  Image<float> range_m;
  Image<Eigen::Vector3f> normal;  ///< sensor frame, unit, facing the sensor
};

/// What the map looks like from a pose. `range_m` is the mix of expected and median range that the
/// losses use, 0 where the opacity is below the configured minimum.
struct RenderOutput {
  Image<float> range_m;
  Image<float> median_range_m;
  Image<float> alpha;
  Image<Eigen::Vector3f> normal;  ///< sensor frame, unit; zero where nothing is rendered
};

/// One optimiser step, in numbers.
struct StepReport {
  double range_loss = 0.0;
  double opacity_loss = 0.0;
  double normal_loss = 0.0;
  std::size_t pairs = 0;  ///< (Gaussian, tile) pairs: the size of the work

  double Loss() const { return range_loss + opacity_loss + normal_loss; }
};

/// Gaussians in the frames of their anchors (keyframes), and the training views of those anchors.
/// Not thread-safe: one owner. Indices of Gaussians are positions in Gaussians(); those between
/// Ranges() are padding. Appending keeps indices, Keep changes them.
class SplatEngine {
 public:
  virtual ~SplatEngine() = default;

  /// What does the work, for people: "cpu", or "cuda" with the device's name.
  virtual std::string Device() const = 0;

  /// A new anchor at a pose; anchors are numbered from 0.
  virtual int AddAnchor(const SE3& T_map_anchor) = 0;
  /// Moves an anchor and, with it, exactly and at no cost, all its Gaussians and its view.
  virtual void SetAnchorPose(int anchor, const SE3& T_map_anchor) = 0;
  virtual const std::vector<SE3>& AnchorPoses() const = 0;

  /// Appends Gaussians given in the anchor's frame; returns where they went.
  virtual AnchorRange Append(int anchor, const GaussianColumns<float>& fresh) = 0;
  /// Removes all Gaussians whose flag is 0 (one flag per row of Gaussians()). Returns where the
  /// others have gone.
  virtual RowMoves Keep(std::span<const std::uint8_t> keep) = 0;
  virtual const GaussianColumns<float>& Gaussians() const = 0;
  virtual const std::vector<AnchorRange>& Ranges() const = 0;

  /// Makes an anchor's measurement a training view (one for each anchor; a second replaces it).
  virtual void SetView(int anchor, const RangeMeasurement& measurement) = 0;
  /// Frees an anchor's view, which then takes no steps any more.
  virtual void DropView(int anchor) = 0;

  virtual RenderOutput Render(const SE3& T_map_sensor) = 0;
  /// One step of the optimiser on an anchor's view. `surface_normals`: with the N_surf term.
  virtual StepReport Step(int anchor, bool surface_normals) = 0;
};

struct EngineConfig {
  RasterConfig raster;
  LossConfig loss;
  OptimizerConfig optimizer;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Section("raster", c.raster, "rendering of Gaussians");
    v.Section("loss", c.loss, "weights of the mapping loss");
    v.Section("optimizer", c.optimizer, "Adam");
  }
};

/// The engine of a backend; kUnavailable if this build or machine does not have it. `auto` takes
/// CUDA where it can, else the CPU, whose Device() then says why. `pool` must outlive the engine.
Result<std::unique_ptr<SplatEngine>> MakeSplatEngine(Backend backend,
                                                     const SensorModel& sensor,
                                                     const EngineConfig& config,
                                                     ThreadPool& pool);

}  // namespace covsplat
