#include "apps/simulate_preview.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "covsplat/report/png.hpp"

namespace covsplat {
namespace {

constexpr int kRows = 300;
constexpr int kColumns = 1080;
constexpr double kTopDeg = 60.0;
constexpr double kBottomDeg = -40.0;
constexpr double kReachM = 150.0;
constexpr Rgb kSky{206, 219, 232};

std::uint8_t Byte(float shade) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(shade, 0.0f, 1.0f)));
}

float Mix(float from, float to, float share) { return from + share * (to - from); }

Rgb Shade(const WorldSnapshot::Hit& hit) {
  const Eigen::Vector3f sun = Eigen::Vector3f(0.45f, -0.3f, 0.84f).normalized();
  const float light = 0.55f + 0.3f * hit.normal.dot(sun) + 0.15f * std::abs(hit.normal.x());
  const float bright = std::sqrt(hit.reflectivity) * light;  // reflectivity is linear, sRGB is not
  const float haze = 1.0f - std::exp(-hit.range_m / 90.0f);
  const bool moves = hit.label != PointLabel::kStatic;
  return {Byte(Mix(moves ? 0.4f + 0.6f * bright : bright, 0.81f, haze)),
          Byte(Mix(moves ? 0.3f * bright : bright, 0.86f, haze)),
          Byte(Mix(moves ? 0.25f * bright : 0.97f * bright, 0.91f, haze))};
}

}  // namespace

Result<std::vector<std::uint8_t>> PreviewPng(const Simulation& simulation,
                                             double time_s,
                                             ThreadPool& pool) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  const SensorModel panorama =
      UniformSensorModel(kRows, kColumns, kBottomDeg * kRadians, kTopDeg * kRadians, 0.0, kReachM);
  const SE3 T_world_sensor = simulation.SensorMotion().PoseAt(time_s);
  const Eigen::Vector3f ahead =
      (T_world_sensor.Rotation() * Eigen::Vector3d::UnitX()).cast<float>();
  const Eigen::Matrix3f R_world_level =
      Eigen::AngleAxisf(std::atan2(ahead.y(), ahead.x()), Eigen::Vector3f::UnitZ())
          .toRotationMatrix();
  const WorldSnapshot world({simulation.StaticWorld(), simulation.Movers()},
                            time_s,
                            T_world_sensor.Translation(),
                            kReachM);
  Image<Rgb> picture(kRows, kColumns, kSky);
  ParallelFor(pool, kRows, 8, [&](std::size_t begin, std::size_t end) {
    for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const auto hit = world.Look(R_world_level * panorama.RayOf(row, column));
        if (hit) picture(row, column) = Shade(*hit);
      }
    }
  });
  return EncodePng(picture);
}

}  // namespace covsplat
