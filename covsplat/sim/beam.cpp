#include "covsplat/sim/beam.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr double kPi = std::numbers::pi;
constexpr std::uint64_t kEdgeStream = 1ULL << 63;  // random numbers apart from those of the noise

// Chance that a return at `sine` of the angle between ray and surface is seen.
double ChanceOfReturn(const SimulatedLidarConfig& config, double sine) {
  const double grazing = config.grazing_deg * kPi / 180.0;
  if (grazing <= 0.0) return 1.0;
  const double angle = std::asin(std::clamp(sine, 0.0, 1.0));
  return std::clamp(angle / grazing - 1.0, 0.0, 1.0);
}

// A direction within the beam, even over its cross section.
Vector3f WithinBeam(const Vector3f& direction, double divergence_rad, Rng& rng) {
  const double radius = 0.5 * divergence_rad * std::sqrt(rng.Uniform());
  const double angle = 2.0 * kPi * rng.Uniform();
  const Vector3f side = direction.unitOrthogonal();
  const Vector3f offset = static_cast<float>(radius * std::cos(angle)) * side +
                          static_cast<float>(radius * std::sin(angle)) * direction.cross(side);
  return (direction + offset).normalized();
}

// Range that the beam measures without noise: that of the surface in its middle, or mixed.
double TrueRange(const WorldSnapshot& world,
                 const WorldSnapshot::Hit& middle,
                 const Vector3f& direction,
                 const SimulatedLidarConfig& config,
                 std::uint64_t number) {
  constexpr float kAnotherSurfaceM = 0.05f;
  const double range = static_cast<double>(middle.range_m);
  if (config.mixed_pixel_probability <= 0.0 || config.beam_divergence_mrad <= 0.0) return range;
  Rng rng(static_cast<std::uint64_t>(config.seed), number ^ kEdgeStream);
  if (rng.Uniform() >= config.mixed_pixel_probability) return range;
  const Vector3f aside = WithinBeam(direction, 1e-3 * config.beam_divergence_mrad, rng);
  const auto other = world.Look(aside);
  if (!other) return range;
  // Where the second ray would meet the plane of the first hit.
  const float slant = middle.normal.dot(aside);
  if (slant >= 0.0f) return range;
  const float on_plane_m = middle.range_m * middle.normal.dot(direction) / slant;
  const double gap_m = static_cast<double>(other->range_m) - range;
  if (std::abs(other->range_m - on_plane_m) < kAnotherSurfaceM) return range;
  if (std::abs(gap_m) > config.pulse_length_m) return range;
  return range + gap_m * rng.Uniform();
}

}  // namespace

std::optional<BeamReturn> SendBeam(const WorldSnapshot& world,
                                   const Vector3f& direction,
                                   const SimulatedLidarConfig& config,
                                   std::uint64_t number) {
  constexpr float kHalfIntensityRange2 = 20.0f * 20.0f;
  const auto hit = world.Look(direction);
  if (!hit) return std::nullopt;
  Rng rng(static_cast<std::uint64_t>(config.seed), number);
  const float sine = -hit->normal.dot(direction);
  const double seen =
      (1.0 - config.dropout_probability) * ChanceOfReturn(config, static_cast<double>(sine));
  if (rng.Uniform() >= seen) return std::nullopt;
  const double noise_m = std::hypot(config.range_noise_m,
                                    config.range_noise_per_m * static_cast<double>(hit->range_m));
  const double range = TrueRange(world, *hit, direction, config, number) + noise_m * rng.Normal();
  if (range <= config.min_range_m || range >= config.max_range_m) return std::nullopt;
  const float fading = kHalfIntensityRange2 / (kHalfIntensityRange2 + hit->range_m * hit->range_m);
  return BeamReturn{static_cast<float>(range),
                    std::clamp(hit->reflectivity * sine * fading, 0.0f, 1.0f),
                    hit->label};
}

}  // namespace covsplat
