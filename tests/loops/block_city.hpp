// A town of blocks to drive round in, whose every corner looks different.
#pragma once

#include <vector>

#include "tests/support/registration_fixtures.hpp"

#include "covsplat/core/rng.hpp"
#include "covsplat/loops/local_map.hpp"

namespace covsplat::test {

/// Streets 16 m wide round a block of 34 m, with houses of random sizes on both sides and things
/// that stand about. The middle of the streets is a square of 50 m round the origin.
inline RayScene BlockCity(std::uint64_t seed = 7) {
  constexpr double kHalf = 25.0;
  Rng rng(seed);
  RayScene city({{{-1e4, -1e4, -10.0}, {1e4, 1e4, -1.5}}});  // the ground
  for (int side = 0; side < 4; ++side) {
    for (double along = -kHalf - 8.0; along < kHalf + 8.0;) {
      const double width = rng.Uniform(4.0, 9.0);
      const double near = kHalf + rng.Uniform(6.0, 9.0);
      const double height = rng.Uniform(3.0, 12.0);
      const double inner = kHalf - rng.Uniform(6.0, 9.0);
      const double inner_height = rng.Uniform(3.0, 12.0);
      const auto add = [&](double across0, double across1, double a0, double a1, double top) {
        const double sign = side < 2 ? 1.0 : -1.0;
        const double c0 = std::min(sign * across0, sign * across1);
        const double c1 = std::max(sign * across0, sign * across1);
        if (side % 2 == 0) {
          city.Add({{a0, c0, -1.5}, {a1, c1, top}});
        } else {
          city.Add({{c0, a0, -1.5}, {c1, a1, top}});
        }
      };
      add(near, near + 8.0, along, along + width - rng.Uniform(0.5, 2.5), height);
      if (std::abs(along) < kHalf - 10.0) {
        add(inner - 6.0, inner, along, along + width - rng.Uniform(0.5, 2.0), inner_height);
      }
      const double thing = kHalf + rng.Uniform(-4.5, 4.5);
      if (std::abs(thing - kHalf) > 2.0) {
        add(thing, thing + 0.6, along, along + rng.Uniform(0.4, 2.0), rng.Uniform(-0.8, 0.5));
      }
      along += width;
    }
  }
  return city;
}

/// Round the block: 200 m a lap, against the clock from the middle of a side.
inline SE3 RoundTheBlock(double way_m) {
  constexpr double kSide = 50.0;
  const double at = way_m / kSide + 0.5;
  const int side = static_cast<int>(std::floor(at));
  const double along = kSide * (at - side) - 0.5 * kSide;
  const Eigen::AngleAxisd heading(0.5 * M_PI * side, Eigen::Vector3d::UnitZ());
  return {Eigen::Quaterniond(heading), heading * Eigen::Vector3d(along, -0.5 * kSide, 0.0)};
}

/// What a sensor at rest sees there.
inline Place PlaceAt(const RayScene& scene,
                     int keyframe,
                     const SE3& T_map_sensor,
                     std::uint64_t seed,
                     ThreadPool& pool) {
  const SensorModel sensor = UniformSensorModel(32, 512, -0.4, 0.3, 0.5, 60.0);
  const Motion still = [&](double) { return T_map_sensor; };
  Scan scan = Simulate(scene, sensor, still, 0.0, 0.01, seed);
  scan.time_offset_s.clear();
  const SourceCloud source = PreprocessStill(scan, pool);
  return MakePlace(keyframe, scan.points, source.points, source.covariance, 0.5);
}

}  // namespace covsplat::test
