#include <algorithm>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/registration/scan_residuals.hpp"

namespace covsplat::test {
namespace {

ScanMotion MotionPlus(const ScanMotion& motion, int unknown, double step) {
  Vector18d delta = Vector18d::Zero();
  delta[unknown] = step;
  return {motion.T_map_sensor * SE3::Exp(delta.head<6>()),
          motion.twist + delta.segment<6>(6),
          motion.acceleration + delta.tail<6>()};
}

// A handheld scan against the room, evaluated a little off the truth.
class NormalEquationsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<TargetSurfel> surfels;
    AppendSurfels(StillCloud(Room(), SE3(), 0.0, 1, pool_), SE3(), surfels);
    target_ = RegistrationTarget(surfels, Eigen::Vector3d(3.0, -2.0, 1.0), 1);
    const Scan scan = Simulate(Room(), SimulatedSensor(), HandheldWalk, 1.0, 0.0);
    motion_.T_map_sensor = HandheldWalk(1.0) * MakePose(0.01, 0.02, 0.01, 3.1, -1.9, 1.0);
    motion_.twist << 0.05, -0.04, 0.1, 0.15, 0.02, -0.03;
    motion_.acceleration << 0.03, 0.05, -0.04, 0.02, 0.01, 0.03;
    source_ = Preprocess(scan, TimeScan(scan, {}), motion_, {}, pool_);
  }

  ThreadPool pool_{2};
  RegistrationTarget target_;
  ScanMotion motion_;
  SourceCloud source_;
};

// Residuals of the current matches in double, each with its own exact pose and a fixed metric.
class FrozenCost {
 public:
  FrozenCost(const SourceCloud& source,
             const RegistrationTarget& target,
             const std::vector<int>& slots,
             const ScanMotion& motion)
      : source_(source), target_(target), slots_(slots), metrics_(source.Size()) {
    for (std::size_t i = 0; i < source.Size(); ++i) {
      if (slots[i] < 0) continue;
      const PointCovariance& c = source.covariance[i];
      const Eigen::Matrix3d R = motion.At(source.phase[i]).RotationMatrix();
      metrics_[i] =
          (Full(target.At(slots[i]).covariance) +
           R * Full(SurfaceCovariance(c.axes, c.sigma_m[0], c.sigma_m[1])) * R.transpose())
              .inverse();
    }
  }

  double operator()(const ScanMotion& motion) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < source_.Size(); ++i) {
      if (slots_[i] < 0) continue;
      const RegistrationTarget::Record& surfel = target_.At(slots_[i]);
      const Eigen::Vector3d position =
          motion.At(source_.phase[i]) * source_.points[i].cast<double>();
      const Eigen::Vector3d e = surfel.mean.cast<double>() + target_.OriginMap() - position;
      sum += 0.5 * surfel.weight * e.dot(metrics_[i] * e);
    }
    return sum;
  }

 private:
  static Eigen::Matrix3d Full(const Eigen::Matrix<float, 6, 1>& v) {
    Eigen::Matrix3f m;
    m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
    return m.cast<double>();
  }

  const SourceCloud& source_;
  const RegistrationTarget& target_;
  const std::vector<int>& slots_;
  std::vector<Eigen::Matrix3d> metrics_;
};

TEST_F(NormalEquationsTest, GradientAndHessianOfAll18UnknownsAgreeWithCentralDifferences) {
  constexpr double kNoKernel = 1e12;
  constexpr double kStep = 1e-4;
  ScanResiduals residuals(source_, target_, 1.0, 0.1, false, pool_);
  const PhaseMoments moments = residuals.Evaluate(motion_, kNoKernel, 1, pool_);
  ASSERT_GT(moments.matches, 1000u);
  const NormalEquations analytic = Assemble(moments, motion_);
  const FrozenCost cost(source_, target_, residuals.Slots(), motion_);
  const double here = cost(motion_);
  EXPECT_NEAR(0.5 * moments.weighted_square / here, 1.0, 1e-4);
  // First order of the neglected terms: a sixth of the square of the motion within the scan.
  constexpr double kTolerance = 1e-3;
  for (int k = 0; k < 18; ++k) {
    const double above = cost(MotionPlus(motion_, k, kStep));
    const double below = cost(MotionPlus(motion_, k, -kStep));
    const double unit = std::sqrt(2.0 * here * analytic.hessian(k, k));  // Cauchy-Schwarz bound
    EXPECT_NEAR(analytic.gradient[k] / unit, (above - below) / (2.0 * kStep) / unit, kTolerance)
        << k;
    const double curvature = (above - 2.0 * here + below) / (kStep * kStep);
    EXPECT_NEAR(analytic.hessian(k, k) / curvature, 1.0, 0.12) << k;
  }
}

// Matches are summed up 16 at a time: any number that is left over counts as much.
TEST_F(NormalEquationsTest, FewMatchesCountLikeMany) {
  for (const std::size_t count :
       {std::size_t{1}, std::size_t{5}, std::size_t{16}, std::size_t{35}}) {
    SourceCloud few;
    few.duration_s = source_.duration_s;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t from = i * source_.Size() / count;
      few.points.push_back(source_.points[from]);
      few.phase.push_back(source_.phase[from]);
      few.covariance.push_back(source_.covariance[from]);
    }
    ScanResiduals residuals(few, target_, 1.0, 0.1, false, pool_);
    const PhaseMoments moments = residuals.Evaluate(motion_, 1e12, 1, pool_);
    ASSERT_GT(moments.matches, 0u) << count;
    const FrozenCost cost(few, target_, residuals.Slots(), motion_);
    EXPECT_NEAR(0.5 * moments.weighted_square / cost(motion_), 1.0, 1e-4) << count;
    EXPECT_TRUE(Assemble(moments, motion_).hessian.allFinite());
    const auto matched =
        std::ranges::count_if(residuals.Slots(), [](int slot) { return slot >= 0; });
    EXPECT_EQ(moments.matches, static_cast<std::size_t>(matched));
  }
}

}  // namespace
}  // namespace covsplat::test
