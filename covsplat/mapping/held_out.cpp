#include "covsplat/mapping/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace covsplat {
namespace {

/// The value that a share of all is below; reorders them.
double AtShare(double share, std::vector<double>& values) {
  const auto n = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), values.begin() + n, values.end());
  return values[static_cast<std::size_t>(n)];
}

}  // namespace

HeldOutErrors MeasureHeldOut(const Image<float>& measured_m, const Image<float>& rendered_m) {
  COVSPLAT_CHECK(measured_m.Size() == rendered_m.Size());
  std::vector<double> errors;
  std::size_t measured = 0;
  for (std::size_t i = 0; i < measured_m.Size(); ++i) {
    const float m = measured_m.Pixels()[i];
    const float r = rendered_m.Pixels()[i];
    measured += m > 0.0f;
    if (m > 0.0f && r > 0.0f) errors.push_back(std::abs(static_cast<double>(r) - m));
  }
  HeldOutErrors result;
  result.pixels = errors.size();
  if (errors.empty()) return result;
  const auto count = static_cast<double>(errors.size());
  result.mean_abs_m = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
  result.median_abs_m = AtShare(0.5, errors);
  result.p90_abs_m = AtShare(0.9, errors);
  result.p95_abs_m = AtShare(0.95, errors);
  result.coverage = count / static_cast<double>(measured);
  return result;
}

Result<std::unique_ptr<SplatEngine>> CopyEngine(const GaussianMap& map,
                                                const GaussianColumns<float>& gaussians,
                                                Backend backend,
                                                const SensorModel& sensor,
                                                const EngineConfig& config,
                                                ThreadPool& pool) {
  Result<std::unique_ptr<SplatEngine>> engine = MakeSplatEngine(backend, sensor, config, pool);
  if (!engine) return engine;
  for (const SE3& T_map_anchor : map.Engine().AnchorPoses()) (*engine)->AddAnchor(T_map_anchor);
  for (const AnchorRange& range : map.Engine().Ranges()) {
    GaussianColumns<float> rows;
    rows.Resize(range.end - range.begin);
    for (int p = 0; p < kParameterCount; ++p) {
      std::copy(gaussians.Column(p) + range.begin, gaussians.Column(p) + range.end, rows.Column(p));
    }
    if (rows.Size() > 0) (*engine)->Append(range.anchor, rows);
  }
  return engine;
}

}  // namespace covsplat
