// Every gradient of the rasteriser against central differences, in double and on whole images.
//
// Blending is smooth except where a contribution crosses the opacity cut or the cap, where the ray
// changes between surface and screen-space filter, where two Gaussians swap places, and where the
// median moves to another Gaussian. The first two cannot happen here (a cut of 1e-12, opacities
// below the cap); the others are found by taking the difference with two step sizes: where they
// disagree, there is no derivative and the sample is left out. Few may be.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/splat/brute_force.hpp"
#include "tests/splat/scenes.hpp"
#include <gtest/gtest.h>

#include "covsplat/splat/cpu/rasterizer.hpp"

namespace covsplat {
namespace {

constexpr double kPi = std::numbers::pi;

RasterConfig SmoothConfig() {
  RasterConfig config;
  config.alpha_min = 1e-12;
  config.transmittance_min = 1e-12;
  return config;
}

/// Weights of every output of every pixel: which scalar of the images is differentiated.
TileGradients<double> RandomUpstream(std::size_t tiles, const std::string& outputs) {
  TileGradients<double> upstream;
  upstream.Resize(tiles);
  Rng rng(99);
  const auto fill = [&](char name, std::vector<double>& image) {
    for (double& value : image) {
      const double weight = rng.Normal();
      if (outputs.find(name) != std::string::npos) value = weight;
    }
  };
  fill('A', upstream.alpha);
  fill('D', upstream.range_sum);
  fill('M', upstream.median);
  fill('N', upstream.normal_x);
  fill('N', upstream.normal_y);
  fill('N', upstream.normal_z);
  return upstream;
}

double Product(const TileGradients<double>& upstream, const TileImages<double>& images) {
  double sum = 0.0;
  for (std::size_t i = 0; i < images.transmittance.size(); ++i) {
    sum += upstream.alpha[i] * (1.0 - images.transmittance[i]) +
           upstream.range_sum[i] * images.range_sum[i] + upstream.median[i] * images.median[i] +
           upstream.normal_x[i] * images.normal_x[i] + upstream.normal_y[i] * images.normal_y[i] +
           upstream.normal_z[i] * images.normal_z[i];
  }
  return sum;
}

void Perturb(GaussianColumns<double>& table, std::size_t i, int tangent, double step) {
  if (tangent < kTangentRotation) {
    table.Column(kMeanX + tangent)[i] += step;
  } else if (tangent < kTangentLogScaleU) {
    const Eigen::Quaterniond q(table.Column(kQuatW)[i],
                               table.Column(kQuatX)[i],
                               table.Column(kQuatY)[i],
                               table.Column(kQuatZ)[i]);
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(tangent - kTangentRotation);
    const Eigen::Quaterniond turned = q * Eigen::Quaterniond(Eigen::AngleAxisd(step, axis));
    table.Column(kQuatW)[i] = turned.w();
    table.Column(kQuatX)[i] = turned.x();
    table.Column(kQuatY)[i] = turned.y();
    table.Column(kQuatZ)[i] = turned.z();
  } else {
    table.Column(kLogScaleU + tangent - kTangentLogScaleU)[i] += step;
  }
}

class Scene {
 public:
  Scene(const RasterConfig& config, double azimuth, const SE3& T_map_anchor)
      : table(RandomGaussians<double>(32, azimuth, 17)),
        rasterizer(SmallSensor(), config, pool_),
        T_map_anchor_(T_map_anchor) {}

  double Value(const TileGradients<double>& upstream, const GaussianColumns<double>& at) {
    Look(at);
    rasterizer.Render();
    return Product(upstream, rasterizer.Images());
  }

  GradientColumns<double> Gradient(const TileGradients<double>& upstream) {
    Look(table);
    rasterizer.StepUpstream(upstream);
    return Collected();
  }

  GradientColumns<double> Gradient(const TileTargets<double>& targets,
                                   const LossConfig& loss,
                                   const TileGradients<double>* upstream = nullptr) {
    Look(table);
    rasterizer.StepLoss(targets, loss, upstream);
    return Collected();
  }

  void Look(const GaussianColumns<double>& at) {
    const AnchorRange range{0, 0, at.Size()};
    rasterizer.LookFrom(SE3(), at, {&range, 1}, {&T_map_anchor_, 1});
  }

  GaussianColumns<double> table;

 private:
  GradientColumns<double> Collected() {
    GradientColumns<double> gradients;
    gradients.Resize(table.Size());
    rasterizer.Collect(table, gradients);
    return gradients;
  }

  ThreadPool pool_{1};

 public:
  Rasterizer<double> rasterizer;

 private:
  SE3 T_map_anchor_;
};

SE3 SomeAnchor() { return SE3::Exp((Vector6d() << 0.1, -0.2, 0.15, 0.3, -0.2, 0.1).finished()); }

struct Comparison {
  double median_error = 0.0;
  double worst_error = 0.0;
  double skipped_share = 0.0;
  double largest = 0.0;
};

/// Relative errors of one tangent over all Gaussians of a scene.
template <class ValueAt>
Comparison CompareTangent(const GaussianColumns<double>& table,
                          const GradientColumns<double>& gradients,
                          int tangent,
                          const ValueAt& value_at) {
  Comparison result;
  std::vector<double> errors;
  const double* analytic = gradients.Column(tangent);
  double largest_of_all = 0.0;
  for (std::size_t i = 0; i < table.Size(); ++i) {
    result.largest = std::max(result.largest, std::abs(analytic[i]));
    for (int t = 0; t < kTangentCount; ++t) {
      largest_of_all = std::max(largest_of_all, std::abs(gradients.Column(t)[i]));
    }
  }
  for (std::size_t i = 0; i < table.Size(); ++i) {
    const auto difference = [&](double step) {
      GaussianColumns<double> up = table;
      GaussianColumns<double> down = table;
      Perturb(up, i, tangent, step);
      Perturb(down, i, tangent, -step);
      return (value_at(up) - value_at(down)) / (2.0 * step);
    };
    const double coarse = difference(2e-5);
    const double fine = difference(1e-5);
    // Gradients that are zero by nature only have the rounding of the differences.
    const double scale = std::abs(fine) + 1e-4 * result.largest + 1e-5 * largest_of_all;
    if (std::abs(coarse - fine) > 1e-4 * scale) continue;
    errors.push_back(std::abs(analytic[i] - fine) / scale);
  }
  result.skipped_share =
      1.0 - static_cast<double>(errors.size()) / static_cast<double>(table.Size());
  std::sort(errors.begin(), errors.end());
  if (!errors.empty()) {
    result.median_error = errors[errors.size() / 2];
    result.worst_error = errors.back();
  }
  return result;
}

void CheckAllTangents(double azimuth, const std::string& outputs) {
  Scene scene(SmoothConfig(), azimuth, SomeAnchor());
  const TileGradients<double> upstream = RandomUpstream(scene.rasterizer.View().Tiles(), outputs);
  const GradientColumns<double> gradients = scene.Gradient(upstream);
  for (int tangent = 0; tangent < kTangentCount; ++tangent) {
    const Comparison c =
        CompareTangent(scene.table, gradients, tangent, [&](const GaussianColumns<double>& at) {
          return scene.Value(upstream, at);
        });
    EXPECT_LT(c.median_error, 1e-6) << "outputs " << outputs << " tangent " << tangent;
    EXPECT_LT(c.worst_error, 1e-3) << "outputs " << outputs << " tangent " << tangent;
    EXPECT_LT(c.skipped_share, 0.35) << "outputs " << outputs << " tangent " << tangent;
    if (outputs != "M" || tangent < 5) {  // a median has no opacity, scale or spin
      EXPECT_GT(c.largest, 0.0) << "outputs " << outputs << " tangent " << tangent;
    }
  }
}

TEST(RasterizerGradient, Opacity) { CheckAllTangents(0.0, "A"); }
TEST(RasterizerGradient, ExpectedRange) { CheckAllTangents(0.0, "D"); }
TEST(RasterizerGradient, MedianRange) { CheckAllTangents(0.0, "M"); }
TEST(RasterizerGradient, Normals) { CheckAllTangents(0.0, "N"); }
TEST(RasterizerGradient, EverythingAcrossTheSeam) { CheckAllTangents(kPi, "ADMN"); }

TEST(RasterizerGradient, BothBranchesAreExercised) {
  // The scene of the gradient tests has pixels on surfaces and pixels on filters: without the
  // filter nothing would change, without surfaces everything would.
  Scene scene(SmoothConfig(), 0.0, SomeAnchor());
  RasterConfig wide = SmoothConfig();
  wide.lowpass = 0.5;
  Scene other(wide, 0.0, SomeAnchor());
  scene.Look(scene.table);
  scene.rasterizer.Render();
  other.Look(other.table);
  other.rasterizer.Render();
  int same = 0;
  int changed = 0;
  for (std::size_t i = 0; i < scene.rasterizer.Images().range_sum.size(); ++i) {
    if (scene.rasterizer.Images().transmittance[i] > 0.999) continue;
    const bool equal = std::abs(scene.rasterizer.Images().range_sum[i] -
                                other.rasterizer.Images().range_sum[i]) < 1e-6;
    (equal ? same : changed)++;
  }
  EXPECT_GT(same, 5);
  EXPECT_GT(changed, 5);
}

TEST(RasterizerGradient, CappedOpacityHasNoGradient) {
  RasterConfig config = SmoothConfig();
  config.alpha_cap = 0.5;
  Scene scene(config, 0.0, SE3());
  GaussianColumns<double> one;
  one.Resize(1);
  const Eigen::Quaterniond facing =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitX());
  SetGaussian(one, 0, {5.0, 0.0, 0.0}, facing, 5000.0, 5000.0, 0.9);  // capped wherever it is seen
  scene.table = one;
  const auto upstream = RandomUpstream(scene.rasterizer.View().Tiles(), "A");
  EXPECT_EQ(scene.Gradient(upstream).Column(kTangentOpacityLogit)[0], 0.0);
}

/// Measurements that a scene almost explains.
TileTargets<double> MakeTargets(Scene& scene) {
  scene.Look(scene.table);
  scene.rasterizer.Render();
  const TileImages<double>& images = scene.rasterizer.Images();
  const ViewGeometry<double>& view = scene.rasterizer.View();
  TileTargets<double> targets;
  targets.Resize(view.Tiles());
  Rng rng(5);
  for (int pixel = 0; pixel < view.rows * view.columns; ++pixel) {
    if (rng.Uniform() < 0.2) continue;
    const std::size_t i = PixelIndex(view, pixel / view.columns, pixel % view.columns);
    const double alpha = std::max(1.0 - images.transmittance[i], 0.2);
    targets.range_m[i] = images.range_sum[i] / alpha +
                         rng.Uniform(0.3, 0.6) * (rng.Uniform() < 0.5 ? -1.0 : 1.0) + 1.0;
    ++targets.valid_ranges;
    const Eigen::Vector3d normal =
        Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal()).normalized();
    targets.normal_x[i] = normal.x();
    targets.normal_y[i] = normal.y();
    targets.normal_z[i] = normal.z();
    ++targets.valid_normals;
    targets.surface_x[i] = -normal.y();
    targets.surface_y[i] = normal.x();
    targets.surface_z[i] = normal.z();
  }
  return targets;
}

/// The terms of one pixel written down again from paper eqs. 10 to 12, each Gaussian's range for
/// itself, on what the slow twin blends. `i`: the pixel in the targets.
double LossOf(const PixelSums& pixel,
              const TileTargets<double>& targets,
              std::size_t i,
              const LossConfig& loss) {
  const auto ranges = static_cast<double>(targets.valid_ranges);
  const auto normals = static_cast<double>(targets.valid_normals);
  const double alpha = 1.0 - pixel.transmittance;
  double sum = -loss.opacity * std::log(alpha + loss.opacity_epsilon) / ranges;
  if (alpha <= loss.min_alpha) return sum;
  for (const RayHit& hit : pixel.hits) {
    const double error = std::min(std::abs(hit.range - targets.range_m[i]), loss.range_cap_m);
    sum += hit.weight / alpha * error / ranges;
  }
  const Eigen::Vector3d gicp(targets.normal_x[i], targets.normal_y[i], targets.normal_z[i]);
  const Eigen::Vector3d flat(targets.surface_x[i], targets.surface_y[i], targets.surface_z[i]);
  sum += loss.gicp_normal * (1.0 - pixel.normal.dot(gicp) / alpha) / normals;
  sum += loss.surface_normal * (1.0 - pixel.normal.dot(flat) / alpha) / ranges;
  return sum;
}

double LossOf(Scene& scene,
              const RasterConfig& config,
              const TileTargets<double>& targets,
              const LossConfig& loss) {
  const SensorModel sensor = SmallSensor();
  double sum = 0.0;
  for (int row = 0; row < sensor.Rows(); ++row) {
    for (int column = 0; column < sensor.Columns(); ++column) {
      const std::size_t i = PixelIndex(scene.rasterizer.View(), row, column);
      if (targets.range_m[i] <= 0.0) continue;
      const PixelSums pixel = BlendPixel(sensor, config, scene.table, SomeAnchor(), row, column);
      sum += LossOf(pixel, targets, i, loss);
    }
  }
  return sum;
}

TEST(RasterizerGradient, WholeLoss) {
  const RasterConfig config = SmoothConfig();
  Scene scene(config, kPi, SomeAnchor());
  const TileTargets<double> targets = MakeTargets(scene);
  LossConfig loss;
  loss.gicp_normal = 0.5;
  loss.surface_normal = 0.3;
  loss.range_cap_m = 1.2;      // some errors are larger, some smaller
  loss.hidden_margin_m = 1e6;  // the full derivative
  loss.through_filter = true;
  const LossSums sums = scene.rasterizer.StepLoss(targets, loss, nullptr);
  EXPECT_NEAR(sums.Total(), LossOf(scene, config, targets, loss), 1e-9);
  const GradientColumns<double> gradients = scene.Gradient(targets, loss);
  for (int tangent = 0; tangent < kTangentCount; ++tangent) {
    const Comparison c =
        CompareTangent(scene.table, gradients, tangent, [&](const GaussianColumns<double>& at) {
          scene.Look(at);
          return scene.rasterizer.StepLoss(targets, loss, nullptr).Total();
        });
    EXPECT_LT(c.median_error, 1e-6) << "tangent " << tangent;
    EXPECT_LT(c.worst_error, 1e-3) << "tangent " << tangent;
    EXPECT_LT(c.skipped_share, 0.35) << "tangent " << tangent;
  }
}

TEST(RasterizerGradient, AMeasurementChangesNothingBehindIt) {
  Scene scene(SmoothConfig(), 0.0, SE3());
  TileTargets<double> targets = MakeTargets(scene);
  constexpr double kMeasured = 5.0;
  for (double& range : targets.range_m) range = range > 0.0 ? kMeasured : 0.0;
  const auto gradient = [&](double margin_m) {
    LossConfig loss;
    loss.hidden_margin_m = margin_m;
    loss.through_filter = true;
    return scene.Gradient(targets, loss);
  };
  const LossConfig defaults;
  const GradientColumns<double> all = gradient(1e6);
  const GradientColumns<double> reached = gradient(defaults.hidden_margin_m);
  const double limit = kMeasured * (1.0 + defaults.hidden_margin_ratio) + defaults.hidden_margin_m;
  int before = 0;
  int behind = 0;
  for (std::size_t i = 0; i < scene.table.Size(); ++i) {
    const Eigen::Vector3d mean(scene.table.Column(kMeanX)[i],
                               scene.table.Column(kMeanY)[i],
                               scene.table.Column(kMeanZ)[i]);
    const double extent = 5.0 * std::exp(std::max(scene.table.Column(kLogScaleU)[i],
                                                  scene.table.Column(kLogScaleV)[i]));
    for (int tangent = 0; tangent < kTangentCount; ++tangent) {
      if (mean.norm() + extent < limit) {
        const double whole = all.Column(tangent)[i];  // a little of it at five deviations
        EXPECT_NEAR(reached.Column(tangent)[i], whole, 1e-4 * std::abs(whole)) << i;
        before += all.Column(tangent)[i] != 0.0;
      } else if (mean.norm() - extent > limit) {
        EXPECT_EQ(reached.Column(tangent)[i], 0.0) << i << " " << tangent;
        behind += all.Column(tangent)[i] != 0.0;
      }
    }
  }
  EXPECT_GT(before, 20);
  EXPECT_GT(behind, 20);
}

TEST(RasterizerGradient, WhatOnlyTheFilterShowsDoesNotLearn) {
  Scene scene(SmoothConfig(), 0.0, SE3());
  const TileTargets<double> targets = MakeTargets(scene);
  const Eigen::Quaterniond facing =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitX());
  scene.table.Resize(2);
  SetGaussian(scene.table, 0, {5.0, 1.5, 0.1}, facing, 0.4, 0.3, 0.7);
  SetGaussian(scene.table, 1, {5.0, -1.5, 0.1}, facing, 1e-4, 1e-4, 0.7);  // far below a pixel
  const auto gradient = [&](bool through_filter) {
    LossConfig loss;
    loss.through_filter = through_filter;
    return scene.Gradient(targets, loss);
  };
  const GradientColumns<double> with = gradient(true);
  const GradientColumns<double> without = gradient(false);
  EXPECT_NE(with.Column(kTangentOpacityLogit)[1], 0.0);
  EXPECT_NE(without.Column(kTangentOpacityLogit)[0], 0.0);
  for (int tangent = 0; tangent < kTangentCount; ++tangent) {
    EXPECT_EQ(without.Column(tangent)[1], 0.0) << tangent;
  }
}

TEST(RasterizerGradient, LearningFromSurfacesOnlyIsTheSameWithoutImages) {
  // Without a gradient from outside, a loss of surfaces takes a shorter way through the tiles.
  Scene scene(SmoothConfig(), kPi, SomeAnchor());
  const TileTargets<double> targets = MakeTargets(scene);
  TileGradients<double> nothing;
  nothing.Resize(scene.rasterizer.View().Tiles());
  const LossConfig loss;
  ASSERT_FALSE(loss.through_filter);
  const GradientColumns<double> shorter = scene.Gradient(targets, loss);
  const GradientColumns<double> whole = scene.Gradient(targets, loss, &nothing);
  for (int tangent = 0; tangent < kTangentCount; ++tangent) {
    int learns = 0;
    for (std::size_t i = 0; i < scene.table.Size(); ++i) {
      const double expected = whole.Column(tangent)[i];
      EXPECT_NEAR(shorter.Column(tangent)[i], expected, 1e-12 * std::abs(expected)) << i;
      learns += expected != 0.0;
    }
    EXPECT_GT(learns, 10) << tangent;
  }
}

TEST(RasterizerGradient, FloatFollowsDouble) {
  const SensorModel sensor = SmallSensor();
  const RasterConfig config;
  const GaussianColumns<float> table = RandomGaussians<float>(64, kPi, 23);
  GaussianColumns<double> exact_table = Convert<double>(table);
  GaussianColumns<float> single_table = table;
  ThreadPool pool(1);
  Rasterizer<float> single(sensor, config, pool);
  Rasterizer<double> exact(sensor, config, pool);
  const AnchorRange range{0, 0, table.Size()};
  const SE3 T_map_anchor;
  single.LookFrom(SE3(), table, {&range, 1}, {&T_map_anchor, 1});
  exact.LookFrom(SE3(), exact_table, {&range, 1}, {&T_map_anchor, 1});
  const TileGradients<double> upstream = RandomUpstream(exact.View().Tiles(), "ADMN");
  TileGradients<float> upstream_single;
  upstream_single.Resize(exact.View().Tiles());
  const auto copy = [](const std::vector<double>& from, std::vector<float>& to) {
    std::transform(
        from.begin(), from.end(), to.begin(), [](double v) { return static_cast<float>(v); });
  };
  copy(upstream.alpha, upstream_single.alpha);
  copy(upstream.range_sum, upstream_single.range_sum);
  copy(upstream.median, upstream_single.median);
  copy(upstream.normal_x, upstream_single.normal_x);
  copy(upstream.normal_y, upstream_single.normal_y);
  copy(upstream.normal_z, upstream_single.normal_z);
  single.StepUpstream(upstream_single);
  exact.StepUpstream(upstream);
  GradientColumns<float> got;
  GradientColumns<double> want;
  got.Resize(table.Size());
  want.Resize(table.Size());
  single.Collect(single_table, got);
  exact.Collect(exact_table, want);
  for (int tangent = 0; tangent < kTangentCount; ++tangent) {
    double largest = 0.0;
    for (std::size_t i = 0; i < table.Size(); ++i) {
      largest = std::max(largest, std::abs(want.Column(tangent)[i]));
    }
    std::vector<double> errors;
    for (std::size_t i = 0; i < table.Size(); ++i) {
      errors.push_back(
          std::abs(static_cast<double>(got.Column(tangent)[i]) - want.Column(tangent)[i]) /
          largest);
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 2e-6) << "tangent " << tangent;
    EXPECT_LT(errors[errors.size() * 9 / 10], 1e-4) << "tangent " << tangent;
  }
}

}  // namespace
}  // namespace covsplat
