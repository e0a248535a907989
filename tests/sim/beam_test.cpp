#include "covsplat/sim/beam.hpp"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "covsplat/sim/scan_pattern.hpp"
#include "covsplat/sim/simulated_lidar.hpp"

namespace covsplat {
namespace {

using Eigen::Vector3f;

constexpr float kNearM = 6.0f;
constexpr float kFarM = 6.4f;

// Two walls across x; the nearer one covers y > 0 only.
Scene StepInDepth(float far_m) {
  MeshBuilder mesh;
  mesh.Quad({kNearM, 0, -9}, {kNearM, 9, -9}, {kNearM, 9, 9}, {kNearM, 0, 9}, 0.5f);
  mesh.Quad({far_m, -9, -9}, {far_m, 9, -9}, {far_m, 9, 9}, {far_m, -9, 9}, 0.5f);
  return Scene(std::move(mesh).Take());
}

SimulatedLidarConfig NoNoise() {
  SimulatedLidarConfig config;
  config.range_noise_m = 0.0;
  config.dropout_probability = 0.0;
  config.grazing_deg = 0.0;
  config.mixed_pixel_probability = 1.0;
  config.beam_divergence_mrad = 10.0;
  config.pulse_length_m = 1.0;
  return config;
}

Vector3f Towards(float y) { return Vector3f(kNearM, y, 0.0f).normalized(); }

TEST(SendBeam, MixedPixelsLieBetweenTheSurfacesAndOnlyAtTheirEdge) {
  const Scene scene = StepInDepth(kFarM);
  const WorldSnapshot world({scene, {}}, 0.0, Eigen::Vector3d::Zero(), 100.0);
  int mixed = 0;
  for (std::uint64_t number = 0; number < 2000; ++number) {
    const auto at_edge = SendBeam(world, Towards(0.01f), NoNoise(), number);
    ASSERT_TRUE(at_edge);
    const float x = at_edge->range_m * Towards(0.01f).x();
    EXPECT_GE(x, kNearM - 1e-3f);
    EXPECT_LE(x, kFarM + 1e-3f);
    if (x > kNearM + 1e-3f) ++mixed;
    const auto beside = SendBeam(world, Towards(0.1f), NoNoise(), number);  // beam: 6 cm wide
    ASSERT_TRUE(beside);
    EXPECT_NEAR(beside->range_m * Towards(0.1f).x(), kNearM, 1e-4f);
  }
  // 10 mm of a disc of 30 mm radius away from the edge: 29 % of it is beyond.
  EXPECT_NEAR(mixed / 2000.0, 0.29, 0.04);
}

TEST(SendBeam, SurfacesFartherApartThanAPulseNeverMix) {
  const Scene scene = StepInDepth(8.0f);
  const WorldSnapshot world({scene, {}}, 0.0, Eigen::Vector3d::Zero(), 100.0);
  for (std::uint64_t number = 0; number < 500; ++number) {
    const auto one = SendBeam(world, Towards(0.01f), NoNoise(), number);
    EXPECT_NEAR(one->range_m * Towards(0.01f).x(), kNearM, 1e-4f);
  }
}

TEST(SendBeam, ASlantedPlaneIsNoEdge) {
  MeshBuilder mesh;
  mesh.Quad({-90, -90, -1}, {90, -90, -1}, {90, 90, -1}, {-90, 90, -1}, 0.5f);
  const Scene floor(std::move(mesh).Take());
  const WorldSnapshot world({floor, {}}, 0.0, Eigen::Vector3d::Zero(), 100.0);
  const Vector3f down = Vector3f(10.0f, 0.0f, -1.0f).normalized();
  for (std::uint64_t number = 0; number < 500; ++number) {
    EXPECT_NEAR(SendBeam(world, down, NoNoise(), number)->range_m, std::sqrt(101.0f), 1e-3f);
  }
}

TEST(SendBeam, NoiseGrowsWithRangeAsTold) {
  SimulatedLidarConfig config = NoNoise();
  config.mixed_pixel_probability = 0.0;
  config.range_noise_m = 0.03;
  config.range_noise_per_m = 0.01;
  const Scene scene = StepInDepth(kFarM);
  const WorldSnapshot world({scene, {}}, 0.0, Eigen::Vector3d::Zero(), 100.0);
  constexpr int kBeams = 4000;
  double sum2 = 0.0;
  for (std::uint64_t number = 0; number < kBeams; ++number) {
    const double error =
        static_cast<double>(
            SendBeam(world, Vector3f(1, 0.1f, 0).normalized(), config, number)->range_m) -
        static_cast<double>(kNearM) * std::sqrt(1.01);
    sum2 += error * error;
  }
  const double expected = std::hypot(0.03, 0.01 * static_cast<double>(kNearM) * std::sqrt(1.01));
  EXPECT_NEAR(std::sqrt(sum2 / kBeams), expected, 4.0 * expected / std::sqrt(2.0 * kBeams));
}

// A box that slides along y at 5 m/s before a wall.
Mover SlidingBox() {
  MeshBuilder mesh;
  mesh.Box({0.0f, 0.0f, -0.5f}, {1.0f, 1.0f, 1.0f}, 0.0f, 0.9f);
  const Motion slide(10.0, [](double time_s) {
    return SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(5.0, 5.0 * time_s, 0.0));
  });
  return MakeMover(
      std::make_shared<const Scene>(std::move(mesh).Take()), PointLabel::kMovingCar, slide);
}

TEST(WorldSnapshot, MoversAreWhereTheyAreAtThatTime) {
  const Scene scene = StepInDepth(20.0f);
  const std::vector<Mover> movers = {SlidingBox()};
  for (const double time_s : {-0.5, 0.0, 0.2}) {
    const WorldSnapshot world({scene, movers}, time_s, Eigen::Vector3d::Zero(), 100.0);
    const double y = 5.0 * time_s;
    const Vector3f at_box = Eigen::Vector3d(4.5, 0.9 * y, 0.0).normalized().cast<float>();
    const auto hit = world.Look(at_box);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->label, PointLabel::kMovingCar);
    EXPECT_NEAR(hit->range_m, 4.5f / at_box.x(), 1e-4f);
    EXPECT_NEAR(hit->normal.x(), -1.0f, 1e-5f);
    const Vector3f past_it =
        Eigen::Vector3d(4.5, y + (y < 0.0 ? -0.7 : 0.7), 0.0).normalized().cast<float>();
    EXPECT_EQ(world.Look(past_it)->label, PointLabel::kStatic);
  }
}

TEST(SimulateScan, EveryPointOfAMoverIsOnItAtThePointsOwnTimeAndLabelled) {
  SimulatedLidarConfig config = NoNoise();
  config.mixed_pixel_probability = 0.0;
  config.rows = 32;
  const Scene scene = StepInDepth(20.0f);
  const std::vector<Mover> movers = {SlidingBox()};
  const Motion standing(10.0, [](double) { return SE3(); });
  ThreadPool pool(2);
  const Scan scan = SimulateScan({scene, movers}, standing, config, 0, pool);
  ASSERT_EQ(scan.label.size(), scan.points.size());
  int moving = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double time_s = scan.stamp_s + static_cast<double>(scan.time_offset_s[i]);
    const Eigen::Vector3d in_box =
        movers[0].motion.PoseAt(time_s).Inverse() * scan.points[i].cast<double>().eval();
    const bool on_box = std::abs(in_box.cwiseAbs().maxCoeff() - 0.5) < 1e-4;
    EXPECT_EQ(scan.label[i], on_box ? 252u : 0u);
    moving += on_box ? 1 : 0;
  }
  EXPECT_GT(moving, 100);
}

TEST(ScanPattern, ARosetteFillsItsConeAndDoesNotRepeat) {
  const SimulatedLidarConfig config = LidarConfigOf(FindSensorPreset("livox-mid70").value());
  const ScanPattern pattern(config);
  EXPECT_EQ(pattern.Firings(), 10000);
  EXPECT_EQ(pattern.RaysPerFiring(), 1);
  const double edge = std::cos(35.2 * 3.14159265 / 180.0);
  double widest = 1.0;
  double farthest_repeat = 0.0;
  for (int firing = 0; firing < pattern.Firings(); ++firing) {
    const Vector3f ray = pattern.Ray(0, firing, 0);
    ASSERT_NEAR(ray.norm(), 1.0f, 1e-5f);
    ASSERT_GE(static_cast<double>(ray.x()), edge - 1e-6);
    widest = std::min(widest, static_cast<double>(ray.x()));
    farthest_repeat =
        std::max(farthest_repeat, static_cast<double>((ray - pattern.Ray(1, firing, 0)).norm()));
  }
  EXPECT_NEAR(widest, edge, 1e-4);
  EXPECT_GT(farthest_repeat, 0.1);
  EXPECT_NEAR(pattern.TimeOffset(0), -0.05, 1e-5);
}

TEST(LidarConfig, PresetsGiveTheirTablesAndPassTheCheck) {
  for (const SensorPreset& preset : SensorPresets()) {
    const SimulatedLidarConfig config = LidarConfigOf(preset);
    EXPECT_TRUE(CheckLidar(config)) << preset.name;
    if (preset.rosette) continue;
    const SensorModel model = ModelOf(config);
    const SensorModel expected = SensorModelOf(preset).value();
    EXPECT_EQ(model.Columns(), expected.Columns());
    ASSERT_EQ(model.Elevations().size(), expected.Elevations().size());
    for (std::size_t i = 0; i < model.Elevations().size(); ++i) {
      EXPECT_NEAR(model.Elevations()[i], expected.Elevations()[i], 1e-12) << preset.name;
    }
  }
}

TEST(LidarConfig, TheDefaultIsThePresetOs0) {
  const SimulatedLidarConfig usual;
  const SimulatedLidarConfig preset = LidarConfigOf(FindSensorPreset("os0-64").value());
  EXPECT_EQ(preset.rows, usual.rows);
  EXPECT_EQ(preset.columns, usual.columns);
  EXPECT_EQ(preset.elevation_low_deg, usual.elevation_low_deg);
  EXPECT_EQ(preset.min_range_m, usual.min_range_m);
  EXPECT_EQ(preset.max_range_m, usual.max_range_m);
  EXPECT_EQ(preset.range_noise_m, usual.range_noise_m);
  EXPECT_EQ(preset.range_noise_per_m, usual.range_noise_per_m);
  EXPECT_EQ(preset.beam_divergence_mrad, usual.beam_divergence_mrad);
}

TEST(LidarConfig, NonsenseIsAnErrorThatNamesTheField) {
  const auto message = [](const SimulatedLidarConfig& config) {
    const Result<void> checked = CheckLidar(config);
    return checked ? std::string() : checked.error().message;
  };
  SimulatedLidarConfig config = LidarConfigOf(FindSensorPreset("hdl-64e").value());
  config.rows = 16;
  EXPECT_NE(message(config).find("lidar.rows"), std::string::npos);
  config.elevation_deg = {1.0, 2.0};
  config.rows = 2;
  EXPECT_NE(message(config).find("top beam first"), std::string::npos);
  config = {};
  config.min_range_m = 100.0;
  EXPECT_NE(message(config).find("lidar.min_range_m"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
