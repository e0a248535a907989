// The CUDA engine against the CPU engine, and against the slow twins in double where there are any.
//
// Both backends do the same arithmetic in another order, so values agree to some units of rounding,
// but for pixels at a discontinuity: a contribution at the opacity cut, a ray that changes between
// surface and screen-space filter, two Gaussians of equal range, a median that moves on. Images are
// therefore held to a strict tolerance except for a small share of pixels, whose differences may
// not lean to one side. Parameters are compared by how far they moved.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "tests/splat/brute_force.hpp"
#include "tests/splat/scenes.hpp"
#include <gtest/gtest.h>

#include "covsplat/splat/compact_view.hpp"
#include "covsplat/splat/cpu/rasterizer.hpp"
#include "covsplat/splat/cuda/device_info.hpp"

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;

/// Skips every test, saying why, where no device can run it.
class CudaEngineTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Result<std::string> device = cuda::FindDevice();
    if (!device) GTEST_SKIP() << device.error().message;
  }

  std::unique_ptr<SplatEngine> Make(Backend backend,
                                    const SensorModel& sensor,
                                    const EngineConfig& config = {}) {
    return std::move(MakeSplatEngine(backend, sensor, config, pool_).value());
  }

  ThreadPool pool_{2};
};

/// How two lists of values differ.
struct Difference {
  double outside_share = 0.0;  ///< of values that differ by more than the tolerance
  double lean = 0.0;           ///< of those: in how many standard deviations one side is larger
  double worst = 0.0;
};

Difference Compare(std::span<const float> a, std::span<const float> b, double tolerance) {
  Difference result;
  double above = 0.0;
  double below = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    result.worst = std::max(result.worst, std::abs(d));
    if (std::abs(d) <= tolerance) continue;
    (d > 0.0 ? above : below) += 1.0;
  }
  const double outside = above + below;
  result.outside_share = outside / static_cast<double>(std::max<std::size_t>(a.size(), 1));
  if (outside > 0.0) result.lean = std::abs(above - below) / std::sqrt(outside);
  return result;
}

void ExpectClose(std::span<const float> a,
                 std::span<const float> b,
                 double tolerance,
                 double allowed_share,
                 const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  const Difference d = Compare(a, b, tolerance);
  EXPECT_LE(d.outside_share, allowed_share) << what << ", worst " << d.worst;
  EXPECT_LT(d.lean, 5.0) << what;
}

std::span<const float> Components(const Image<Eigen::Vector3f>& image) {
  return {image.Pixels().data()->data(), 3 * image.Size()};
}

void ExpectSameRendering(const RenderOutput& a, const RenderOutput& b, const std::string& what) {
  constexpr double kShare = 0.005;
  ExpectClose(a.alpha.Pixels(), b.alpha.Pixels(), 2e-5, kShare, what + ": alpha");
  ExpectClose(a.range_m.Pixels(), b.range_m.Pixels(), 2e-4, kShare, what + ": range");
  ExpectClose(
      a.median_range_m.Pixels(), b.median_range_m.Pixels(), 2e-4, kShare, what + ": median");
  ExpectClose(Components(a.normal), Components(b.normal), 1e-4, kShare, what + ": normal");
}

double Distance(const GaussianColumns<float>& a,
                const GaussianColumns<float>& b,
                std::size_t row,
                int first,
                int last) {
  double squared = 0.0;
  for (int p = first; p < last; ++p) {
    squared += std::pow(static_cast<double>(a.Column(p)[row] - b.Column(p)[row]), 2);
  }
  return std::sqrt(squared);
}

/// Share of rows that end up apart by more than a tenth of the way they went. Adam makes full steps
/// of gradients that are nothing but rounding, so there are always some.
double ShareApart(const GaussianColumns<float>& start,
                  const GaussianColumns<float>& a,
                  const GaussianColumns<float>& b,
                  int first,
                  int last) {
  double mean = 0.0;
  for (std::size_t i = 0; i < start.Size(); ++i) {
    mean += Distance(b, start, i, first, last) / static_cast<double>(start.Size());
  }
  std::size_t apart = 0;
  for (std::size_t i = 0; i < start.Size(); ++i) {
    const double way = std::max(mean, Distance(b, start, i, first, last));
    apart += Distance(a, b, i, first, last) > 0.1 * way;
  }
  EXPECT_GT(mean, 0.0);
  return static_cast<double>(apart) / static_cast<double>(start.Size());
}

void ExpectMovedAlike(const SplatEngine& cuda,
                      const SplatEngine& cpu,
                      const GaussianColumns<float>& start,
                      double allowed,
                      const std::string& what) {
  const GaussianColumns<float>& a = cuda.Gaussians();
  const GaussianColumns<float>& b = cpu.Gaussians();
  EXPECT_LT(ShareApart(start, a, b, kMeanX, kQuatW), allowed) << what << ": means";
  EXPECT_LT(ShareApart(start, a, b, kQuatW, kLogScaleU), allowed) << what << ": rotations";
  EXPECT_LT(ShareApart(start, a, b, kLogScaleU, kOpacityLogit), allowed) << what << ": log scales";
  EXPECT_LT(ShareApart(start, a, b, kOpacityLogit, kParameterCount), allowed)
      << what << ": opacities";
}

void ExpectSameTable(const GaussianColumns<float>& a, const GaussianColumns<float>& b) {
  ASSERT_EQ(a.Size(), b.Size());
  for (int p = 0; p < kParameterCount; ++p) {
    EXPECT_EQ(std::memcmp(a.Column(p), b.Column(p), a.Size() * sizeof(float)), 0) << "column " << p;
  }
}

/// Two engines that are told the same things.
struct Both {
  std::unique_ptr<SplatEngine> cuda, cpu;

  template <class Action>
  void Do(Action&& action) {
    action(*cuda);
    action(*cpu);
  }
};

Both RoomEngines(std::unique_ptr<SplatEngine> cuda,
                 std::unique_ptr<SplatEngine> cpu,
                 const RangeMeasurement& m) {
  Both both{std::move(cuda), std::move(cpu)};
  both.Do([&](SplatEngine& engine) {
    engine.AddAnchor(SE3());
    engine.Append(0, NoisyRoom(RoomSensor(), m));
    engine.SetView(0, m);
  });
  return both;
}

/// A measurement that random Gaussians almost explain, at some pixels.
RangeMeasurement Explained(const RenderOutput& render) {
  RangeMeasurement m{render.range_m, render.normal};
  Rng rng(5);
  for (std::size_t i = 0; i < m.range_m.Size(); ++i) {
    float& range = m.range_m.Pixels()[i];
    if (range > 0.0f && rng.Uniform() < 0.7) {
      range += static_cast<float>(rng.Uniform(0.3, 0.6) * (rng.Uniform() < 0.5 ? -1.0 : 1.0));
    } else {
      range = 0.0f;
    }
    Eigen::Vector3f& normal = m.normal.Pixels()[i];
    normal = (normal + 0.3f * Eigen::Vector3f(static_cast<float>(rng.Normal()),
                                              static_cast<float>(rng.Normal()),
                                              static_cast<float>(rng.Normal())))
                 .normalized();
  }
  return m;
}

SE3 SomePose() { return SE3::Exp((Vector6d() << 0.1, 0.2, -0.4, 10.0, -5.0, 2.0).finished()); }

TEST_F(CudaEngineTest, SaysWhatItIs) {
  const auto engine = Make(Backend::kAuto, RoomSensor());
  EXPECT_EQ(engine->Device().substr(0, 4), "cuda");
}

TEST_F(CudaEngineTest, RendersWhatTheCpuRenders) {
  for (const double azimuth : {0.0, 1.3, kPi, -kPi + 0.2}) {
    Both both{Make(Backend::kCuda, SmallSensor()), Make(Backend::kCpu, SmallSensor())};
    both.Do([&](SplatEngine& engine) {
      engine.AddAnchor(SomePose());
      engine.Append(0, RandomGaussians<float>(200, azimuth, 7));
    });
    ExpectSameRendering(both.cuda->Render(SomePose()),
                        both.cpu->Render(SomePose()),
                        "azimuth " + std::to_string(azimuth));
  }
}

TEST_F(CudaEngineTest, RendersWhatEveryGaussianOnEveryPixelGives) {
  const SensorModel sensor = SmallSensor();
  GaussianColumns<float> table = RandomGaussians<float>(80, kPi, 9);
  Rng rng(4);
  for (std::size_t i = 0; i < 20; ++i) {  // huge, near and overhead
    const Eigen::Vector3d mean(rng.Uniform(-1.5, 1.5), rng.Uniform(-1.5, 1.5), rng.Uniform(-2, 2));
    const Eigen::Quaterniond q =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -mean.normalized());
    SetGaussian(table, i, mean, q, rng.Uniform(0.3, 3.0), rng.Uniform(0.3, 3.0), 0.6);
  }
  const auto engine = Make(Backend::kCuda, sensor);
  engine->AddAnchor(SE3());
  engine->Append(0, table);
  const RenderOutput render = engine->Render(SE3());
  const GaussianColumns<double> exact = Convert<double>(table);
  std::vector<float> twin_alpha;
  std::vector<float> twin_median;
  std::vector<float> twin_z;
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const PixelSums twin = BlendPixel(sensor, {}, exact, SE3(), row, column);
      const bool covered = 1.0 - twin.transmittance >= LossConfig().min_alpha;
      twin_alpha.push_back(static_cast<float>(1.0 - twin.transmittance));
      twin_median.push_back(covered ? static_cast<float>(twin.median) : 0.0f);
      twin_z.push_back(covered ? static_cast<float>(twin.normal.normalized().z()) : 0.0f);
    }
  }
  std::vector<float> z;
  for (const Eigen::Vector3f& normal : render.normal.Pixels()) z.push_back(normal.z());
  ExpectClose(render.alpha.Pixels(), twin_alpha, 2e-5, 0.01, "alpha");
  ExpectClose(render.median_range_m.Pixels(), twin_median, 2e-4, 0.01, "median");
  ExpectClose(z, twin_z, 2e-4, 0.01, "normal");
}

TEST_F(CudaEngineTest, LongListsAreBlendedAsShortOnesAre) {
  // Hundreds of faint Gaussians on most tiles: every segment of a list needs several batches.
  GaussianColumns<float> table = RandomGaussians<float>(3000, 0.0, 31);
  std::fill_n(table.Column(kOpacityLogit), table.Size(), -3.5f);
  Both both{Make(Backend::kCuda, SmallSensor()), Make(Backend::kCpu, SmallSensor())};
  both.Do([&](SplatEngine& engine) {
    engine.AddAnchor(SE3());
    engine.Append(0, table);
  });
  const RenderOutput render = both.cpu->Render(SE3());
  ExpectSameRendering(both.cuda->Render(SE3()), render, "faint Gaussians");
  const RangeMeasurement m = Explained(render);
  both.Do([&](SplatEngine& engine) { engine.SetView(0, m); });
  for (int step = 0; step < 2; ++step) {
    const StepReport on_cuda = both.cuda->Step(0, true);
    const StepReport on_cpu = both.cpu->Step(0, true);
    EXPECT_NEAR(on_cuda.range_loss, on_cpu.range_loss, 1e-3 * on_cpu.range_loss);
    EXPECT_GT(on_cpu.pairs, 128u * 5u * 16u);  // so many for each tile, though most are empty
  }
  ExpectMovedAlike(*both.cuda, *both.cpu, table, 0.15, "faint Gaussians");
}

struct Switch {
  const char* name;
  void (*set)(EngineConfig&);
};

/// Every switch of the configuration that kernels look at, away from its default.
constexpr Switch kSwitches[] = {
    {"defaults", [](EngineConfig&) {}},
    {"near_m", [](EngineConfig& c) { c.raster.near_m = 4.2; }},
    {"alpha_min", [](EngineConfig& c) { c.raster.alpha_min = 0.05; }},
    {"alpha_cap", [](EngineConfig& c) { c.raster.alpha_cap = 0.5; }},
    {"transmittance_min", [](EngineConfig& c) { c.raster.transmittance_min = 0.1; }},
    {"lowpass", [](EngineConfig& c) { c.raster.lowpass = 4.0; }},
    {"grazing_cosine", [](EngineConfig& c) { c.raster.grazing_cosine = 0.2; }},
    {"two_sided", [](EngineConfig& c) { c.raster.two_sided = true; }},
    {"expected range", [](EngineConfig& c) { c.raster.depth_ratio = 0.0; }},
    {"median range", [](EngineConfig& c) { c.raster.depth_ratio = 1.0; }},
    {"rebin_interval", [](EngineConfig& c) { c.raster.rebin_interval = 1; }},
    {"range_cap_m", [](EngineConfig& c) { c.loss.range_cap_m = 0.02; }},
    {"opacity", [](EngineConfig& c) { c.loss.opacity = 0.5; }},
    {"opacity_epsilon", [](EngineConfig& c) { c.loss.opacity_epsilon = 0.5; }},
    {"gicp_normal", [](EngineConfig& c) { c.loss.gicp_normal = 0.0; }},
    {"surface_normal", [](EngineConfig& c) { c.loss.surface_normal = 0.0; }},
    {"strong surface_normal", [](EngineConfig& c) { c.loss.surface_normal = 5.0; }},
    {"scale", [](EngineConfig& c) { c.loss.max_scale_m = 0.09; }},
    {"min_alpha", [](EngineConfig& c) { c.loss.min_alpha = 0.7; }},
    {"nothing is hidden", [](EngineConfig& c) { c.loss.hidden_margin_m = 1e6; }},
    {"hidden_margin_m", [](EngineConfig& c) { c.loss.hidden_margin_m = 0.0; }},
    {"hidden_margin_ratio", [](EngineConfig& c) { c.loss.hidden_margin_ratio = 1.0; }},
    {"through_filter", [](EngineConfig& c) { c.loss.through_filter = true; }},
    {"max_growth", [](EngineConfig& c) { c.optimizer.max_growth = 1.002; }},
    {"mean_along_normal", [](EngineConfig& c) { c.optimizer.mean_along_normal = false; }},
    {"betas", [](EngineConfig& c) { c.optimizer.beta1 = 0.5, c.optimizer.beta2 = 0.9; }},
};

TEST_F(CudaEngineTest, EverySwitchDoesWhatItDoesOnTheCpu) {
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  for (const Switch& s : kSwitches) {
    EngineConfig config;
    config.optimizer.mean_step_m = 1e-3;
    s.set(config);
    Both both = RoomEngines(
        Make(Backend::kCuda, RoomSensor(), config), Make(Backend::kCpu, RoomSensor(), config), m);
    const GaussianColumns<float> start = both.cpu->Gaussians();
    ExpectSameRendering(both.cuda->Render(SE3()), both.cpu->Render(SE3()), s.name);
    for (int step = 0; step < 2; ++step) {
      const StepReport on_cuda = both.cuda->Step(0, true);
      const StepReport on_cpu = both.cpu->Step(0, true);
      EXPECT_NEAR(on_cuda.range_loss, on_cpu.range_loss, 1e-3 * on_cpu.range_loss) << s.name;
      EXPECT_NEAR(on_cuda.opacity_loss, on_cpu.opacity_loss, 1e-3 * std::abs(on_cpu.opacity_loss))
          << s.name;
      EXPECT_NEAR(on_cuda.normal_loss, on_cpu.normal_loss, 1e-3 * on_cpu.normal_loss) << s.name;
      EXPECT_NEAR(static_cast<double>(on_cuda.pairs),
                  static_cast<double>(on_cpu.pairs),
                  1e-3 * static_cast<double>(on_cpu.pairs))
          << s.name;
    }
    ExpectMovedAlike(*both.cuda, *both.cpu, start, 0.15, s.name);
  }
}

TEST_F(CudaEngineTest, OneStepGoesAlongTheGradientInDouble) {
  // With epsilon far above the gradient the first step of Adam is the gradient times the rate.
  EngineConfig config;
  config.loss.gicp_normal = 20.0;
  config.loss.opacity = 5.0;
  config.loss.scale = 0.0;
  config.optimizer = {1.0, 1.0, 1.0, 10.0, 0.9, 0.999, 1.0, false};
  const SensorModel sensor = SmallSensor();
  const GaussianColumns<float> table = RandomGaussians<float>(64, kPi, 23);
  const auto cuda = Make(Backend::kCuda, sensor, config);
  cuda->AddAnchor(SE3());
  cuda->Append(0, table);
  const RangeMeasurement m = Explained(cuda->Render(SE3()));
  cuda->SetView(0, m);
  cuda->Step(0, false);

  Rasterizer<double> exact(sensor, config.raster, pool_);
  GaussianColumns<double> exact_table = Convert<double>(table);
  const AnchorRange range{0, 0, table.Size()};
  const SE3 T_map_anchor;
  exact.LookFrom(SE3(), exact_table, {&range, 1}, {&T_map_anchor, 1});
  const ViewGeometry<float> geometry(sensor, config.raster);
  TileTargets<float> single;
  CompactView(geometry, sensor.MaxRange(), m).Expand(single);
  TileTargets<double> targets;
  targets.Resize(geometry.Tiles());
  std::copy(single.range_m.begin(), single.range_m.end(), targets.range_m.begin());
  std::copy(single.normal_x.begin(), single.normal_x.end(), targets.normal_x.begin());
  std::copy(single.normal_y.begin(), single.normal_y.end(), targets.normal_y.begin());
  std::copy(single.normal_z.begin(), single.normal_z.end(), targets.normal_z.begin());
  targets.valid_ranges = single.valid_ranges;
  targets.valid_normals = single.valid_normals;
  exact.StepLoss(targets, config.loss, nullptr);
  GradientColumns<double> gradients;
  gradients.Resize(table.Size());
  exact.Collect(exact_table, gradients);

  const auto check = [&](int parameter, int tangent, auto&& step_of) {
    double largest = 0.0;
    std::vector<double> errors;
    for (std::size_t i = 0; i < table.Size(); ++i) {
      const double want = -step_of(i, gradients.Column(tangent)[i]);
      const double got = static_cast<double>(cuda->Gaussians().Column(parameter)[i]) -
                         static_cast<double>(table.Column(parameter)[i]);
      largest = std::max(largest, std::abs(want));
      errors.push_back(std::abs(got - want));
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_GT(largest, 1e-4) << "tangent " << tangent;
    EXPECT_LT(errors[errors.size() / 2], 1e-4 * largest) << "tangent " << tangent;
    EXPECT_LT(errors[errors.size() * 9 / 10], 2e-3 * largest) << "tangent " << tangent;
  };
  for (int k = 0; k < 3; ++k) {
    check(kMeanX + k, kTangentMean + k, [&](std::size_t i, double g) {
      const double* x = gradients.Column(kTangentMean);
      const double* y = gradients.Column(kTangentMean + 1);
      const double* z = gradients.Column(kTangentMean + 2);
      return g / (std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]) + 1.0);
    });
  }
  const auto scalar = [](std::size_t, double g) { return g / (std::abs(g) + 1.0); };
  check(kLogScaleU, kTangentLogScaleU, scalar);
  check(kLogScaleV, kTangentLogScaleV, scalar);
  check(kOpacityLogit, kTangentOpacityLogit, [](std::size_t, double g) {
    return 10.0 * g / (std::abs(g) + 1.0);
  });
}

TEST_F(CudaEngineTest, ManyStepsLeadToTheSameMap) {
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  EngineConfig config;
  config.optimizer.mean_step_m = 1e-3;
  config.optimizer.rotation_step_rad = 5e-3;
  Both both = RoomEngines(
      Make(Backend::kCuda, RoomSensor(), config), Make(Backend::kCpu, RoomSensor(), config), m);
  const GaussianColumns<float> start = both.cpu->Gaussians();
  StepReport on_cuda;
  StepReport on_cpu;
  for (int step = 0; step < 200; ++step) {
    on_cuda = both.cuda->Step(0, step > 50);
    on_cpu = both.cpu->Step(0, step > 50);
    if (step == 24) ExpectMovedAlike(*both.cuda, *both.cpu, start, 0.1, "25 steps");
  }
  EXPECT_NEAR(on_cuda.range_loss, on_cpu.range_loss, 0.01 * on_cpu.range_loss);
  EXPECT_NEAR(on_cuda.normal_loss, on_cpu.normal_loss, 0.01 * on_cpu.normal_loss);
  ExpectMovedAlike(*both.cuda, *both.cpu, start, 0.3, "200 steps");
}

TEST_F(CudaEngineTest, SameBitsEveryTime) {
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  const auto optimise = [&] {
    const auto engine = Make(Backend::kCuda, RoomSensor());
    engine->AddAnchor(SE3());
    engine->Append(0, NoisyRoom(RoomSensor(), m));
    engine->SetView(0, m);
    for (int i = 0; i < 25; ++i) engine->Step(0, true);
    return engine->Gaussians();
  };
  ExpectSameTable(optimise(), optimise());
}

TEST_F(CudaEngineTest, GaussiansComeAndGoAsOnTheCpu) {
  const SensorModel sensor = RoomSensor();
  const RangeMeasurement m = RoomMeasurement(sensor);
  Both both{Make(Backend::kCuda, sensor), Make(Backend::kCpu, sensor)};
  std::vector<std::size_t> sizes = {37, 1, 16, 5000, 50};
  both.Do([&](SplatEngine& engine) {
    for (int anchor = 0; anchor < 3; ++anchor) engine.AddAnchor(SE3());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      engine.Append(static_cast<int>(i % 3), RandomGaussians<float>(sizes[i], 0.3, i));
    }
    engine.SetView(1, m);
  });
  ExpectSameTable(both.cuda->Gaussians(), both.cpu->Gaussians());
  both.Do([](SplatEngine& engine) { engine.Step(1, false); });
  std::vector<std::uint8_t> keep(both.cpu->Gaussians().Size(), 1);
  for (std::size_t i = 0; i < keep.size(); i += 3) keep[i] = 0;
  for (std::size_t i = 0; i < 48; ++i) keep[i] = 0;  // the whole first range
  const GaussianColumns<float> before = both.cuda->Gaussians();
  const std::vector<std::size_t> old_row = OldRows(both.cuda->Keep(keep));
  EXPECT_EQ(old_row, OldRows(both.cpu->Keep(keep)));
  ASSERT_EQ(both.cuda->Ranges().size(), both.cpu->Ranges().size());
  for (std::size_t r = 0; r < both.cuda->Ranges().size(); ++r) {
    const AnchorRange range = both.cuda->Ranges()[r];
    EXPECT_EQ(range.begin, both.cpu->Ranges()[r].begin);
    EXPECT_EQ(range.end, both.cpu->Ranges()[r].end);
    for (std::size_t i = range.begin; i < range.end; ++i) {
      for (int p = 0; p < kParameterCount; ++p) {
        EXPECT_EQ(both.cuda->Gaussians().Column(p)[i], before.Column(p)[old_row[i]]);
      }
    }
  }
  // The optimiser's memory has moved with them, and later Gaussians start without any.
  const GaussianColumns<float> start = both.cpu->Gaussians();
  both.Do([&](SplatEngine& engine) {
    for (int i = 0; i < 5; ++i) engine.Step(1, false);
  });
  ExpectMovedAlike(*both.cuda, *both.cpu, start, 0.1, "steps after Keep");
  both.Do([&](SplatEngine& engine) { engine.Append(2, NoisyRoom(sensor, m)); });
  const GaussianColumns<float> grown = both.cpu->Gaussians();
  both.Do([&](SplatEngine& engine) {
    for (int i = 0; i < 5; ++i) engine.Step(1, false);
  });
  ExpectMovedAlike(*both.cuda, *both.cpu, grown, 0.1, "steps after Append");
}

TEST_F(CudaEngineTest, AMovedAnchorTakesItsGaussiansAlong) {
  ExpectAMovedAnchorTakesItsGaussiansAlong(*Make(Backend::kCuda, RoomSensor()));
}

TEST_F(CudaEngineTest, AnEmptyMapIsTransparentAndCanBeOptimised) {
  const RangeMeasurement m = RoomMeasurement(RoomSensor());
  Both both{Make(Backend::kCuda, RoomSensor()), Make(Backend::kCpu, RoomSensor())};
  both.Do([&](SplatEngine& engine) {
    engine.AddAnchor(SE3());
    engine.SetView(0, m);
  });
  const RenderOutput nothing = both.cuda->Render(SE3());
  for (const float alpha : nothing.alpha.Pixels()) EXPECT_EQ(alpha, 0.0f);
  const StepReport on_cuda = both.cuda->Step(0, true);
  const StepReport on_cpu = both.cpu->Step(0, true);
  EXPECT_NEAR(on_cuda.opacity_loss, on_cpu.opacity_loss, 1e-5 * on_cpu.opacity_loss);
  EXPECT_EQ(on_cuda.pairs, 0u);
  EXPECT_EQ(both.cuda->Gaussians().Size(), 0u);

  // Gaussians that no view can reach are as good as none; so is a map from which all were removed.
  both.Do([](SplatEngine& engine) {
    engine.AddAnchor(SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1000.0, 0.0, 0.0)));
    engine.Append(1, RandomGaussians<float>(40, 0.0, 1));
    engine.Step(0, true);
    engine.Keep(std::vector<std::uint8_t>(engine.Gaussians().Size(), 0));
    engine.Step(0, true);
  });
  EXPECT_EQ(both.cuda->Gaussians().Size(), 0u);
}

TEST_F(CudaEngineTest, BrokenGaussiansAreNotDrawn) {
  const auto engine = Make(Backend::kCuda, SmallSensor());
  engine->AddAnchor(SE3());
  engine->Append(0, BrokenGaussians());
  const RenderOutput render = engine->Render(SE3());
  for (const float alpha : render.alpha.Pixels()) EXPECT_TRUE(alpha >= 0.0f && alpha <= 1.0f);
  for (const float range : render.range_m.Pixels()) EXPECT_TRUE(std::isfinite(range));
  engine->SetView(0, Explained(render));
  for (int i = 0; i < 3; ++i) engine->Step(0, true);
  EXPECT_TRUE(std::isfinite(engine->Gaussians().Column(kMeanX)[20]));
}

}  // namespace
}  // namespace covsplat
