#include "covsplat/loops/odometry_noise.hpp"

#include "tests/loops/pose_graph_fixtures.hpp"
#include <Eigen/LU>
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Matrix6d CovarianceOf(double rotation_rad, double translation_m) {
  return InformationOf(rotation_rad, translation_m).inverse();
}

TEST(StepCovariance, GrowsWithTheWayAndKnowsWhatRegistrationKnows) {
  const OdometryNoiseConfig config;
  const Matrix6d given = StepCovariance(std::nullopt, 4.0, config);
  const Matrix6d noise = CovarianceOf(2.0 * config.sigma_deg * kDegree, 2.0 * config.sigma_m);
  EXPECT_LT((given - noise).norm(), 1e-12);

  const Matrix6d sure = StepCovariance(InformationOf(1e-8, 1e-8), 4.0, config);
  EXPECT_LT((sure - noise).norm(), 1e-12);

  const Matrix6d rough = StepCovariance(InformationOf(1e-4, 1e-2), 4.0, config);
  EXPECT_LT((rough - noise - CovarianceOf(1e-4, 1e-2)).norm(), 1e-2 * 1e-4);
}

TEST(StepCovariance, IsWideWhereSurfacesDoNotHold) {
  const OdometryNoiseConfig config;
  Matrix6d information = InformationOf(1e-6, 1e-6);
  information(3, 3) = 0.0;
  const Matrix6d covariance = StepCovariance(information, 1.0, config);
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), config.weak_sigma_m, 1e-4);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), config.sigma_m, 1e-5);
}

/// Odometry round the square, far away from the origin, and what it is known to err by.
OdometryChain ChainOf(const PoseGraph& odometry) {
  OdometryChain chain;
  chain.Append(odometry.T_map_node[0], Matrix6d::Zero());
  for (const PoseEdge& step : odometry.edges) {
    chain.Append(odometry.T_map_node[static_cast<std::size_t>(step.to)],
                 step.information.inverse());
  }
  return chain;
}

TEST(OdometryChain, ErrsAsMuchAsItsCovariancesSay) {
  std::vector<SE3> truth = SquareWay(1);
  const SE3 away =
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
          {300.0, -200.0, 10.0});
  for (SE3& pose : truth) pose = away * pose;
  constexpr int kTrials = 400;
  double sum = 0.0;
  double sum_if_five_known = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Rng rng(static_cast<std::uint64_t>(trial));
    const OdometryChain chain = ChainOf(Odometry(truth, rng));
    PoseEdge loop = Measured(truth, 10, 190, true, rng);
    sum += chain.SquaredError(loop, 1.0);
    EXPECT_GT(chain.SquaredError(loop, 1.0), chain.SquaredError(loop, 2.0));
    loop.information.row(3).setZero();
    loop.information.col(3).setZero();
    sum_if_five_known += chain.SquaredError(loop, 1.0);
  }
  EXPECT_NEAR(sum / kTrials, 6.0, 0.6);
  EXPECT_NEAR(sum_if_five_known / kTrials, 5.0, 0.5);
}

TEST(OdometryChain, LearnsFromLoopsHowMuchItErrs) {
  constexpr double kTooSure = 5.0;
  const std::vector<SE3> truth = SquareWay(3);
  Rng rng(7);
  PoseGraph odometry = Odometry(truth, rng);
  std::vector<PoseEdge> loops;
  for (int from = 0; from < 400; from += 10) {
    loops.push_back(Measured(truth, from, from + 200, true, rng));
  }
  EXPECT_LT(ChainOf(odometry).ScaleBy(loops, 100.0), 2.0);
  for (PoseEdge& step : odometry.edges) step.information *= kTooSure * kTooSure;
  const OdometryChain chain = ChainOf(odometry);
  const double scale = chain.ScaleBy(loops, 100.0);
  EXPECT_GT(scale, 0.5 * kTooSure * kTooSure);
  EXPECT_LT(scale, 2.0 * kTooSure * kTooSure);
  EXPECT_NEAR(chain.ScaleBy(loops, 4.0), 4.0, 1e-6);
  EXPECT_EQ(chain.ScaleBy({}, 100.0), 1.0);
}

}  // namespace
}  // namespace covsplat::test
