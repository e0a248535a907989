#include "covsplat/mapping/signals.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

// The epsilon of 1e-6 in the denominators of eqs. 7 and 9.
constexpr double kEpsilon = 2e-6;

PointCovariance Surface(float sigma0, float sigma1, float sigma2) {
  return {Eigen::Matrix3f::Identity(), {sigma0, sigma1, sigma2}};
}

const PointCovariance kPlane = Surface(0.2f, 0.2f, 0.0f);
const PointCovariance kNeedle = Surface(0.2f, 0.0f, 0.0f);
const PointCovariance kBall = Surface(0.2f, 0.2f, 0.2f);

/// `each` points of every kind, in turns.
std::vector<PointCovariance> Mixed(std::vector<PointCovariance> kinds, int each) {
  std::vector<PointCovariance> all;
  for (int i = 0; i < each; ++i) all.insert(all.end(), kinds.begin(), kinds.end());
  return all;
}

TEST(PhysicalConfidence, IsOneUpCloseAndHeadOn) {
  EXPECT_NEAR(PhysicalConfidence(0.0, 1.0, {}), 1.0, kEpsilon);
}

TEST(PhysicalConfidence, FallsWithTheSquareOfTheRange) {
  const ConfidenceConfig config{.range_m = 40.0};
  EXPECT_NEAR(PhysicalConfidence(40.0, 1.0, config), std::exp(-1.0), kEpsilon);
  EXPECT_NEAR(PhysicalConfidence(80.0, 1.0, config), std::exp(-4.0), kEpsilon);
}

TEST(PhysicalConfidence, RisesLinearlyFromTheFlattestIncidence) {
  const ConfidenceConfig config{.min_cosine = 0.2};
  EXPECT_EQ(PhysicalConfidence(0.0, 0.1, config), 0.0);
  EXPECT_EQ(PhysicalConfidence(0.0, 0.2, config), 0.0);
  EXPECT_NEAR(PhysicalConfidence(0.0, 0.6, config), 0.5, kEpsilon);
}

TEST(PhysicalConfidence, IsNeverAboveOne) {
  EXPECT_LE(PhysicalConfidence(0.0, 1.0 + 1e-3, {}), 1.0);
}

TEST(ControlScores, AreTheWeightsOfTheTermsWhereOnlyOneTermDiffers) {
  const std::vector<float> at_the_map(40, 0.0f);
  const std::vector<float> linear = ControlScores(Mixed({kPlane, kNeedle}, 20), at_the_map);
  EXPECT_NEAR(linear[0], 0.0, 1e-4);
  EXPECT_NEAR(linear[1], 0.55, 1e-4);  // lambda of 0.04 m^2 against an epsilon of 1e-6
  const std::vector<float> curved = ControlScores(Mixed({kPlane, kBall}, 20), at_the_map);
  EXPECT_NEAR(curved[0], 0.0, 1e-4);
  EXPECT_NEAR(curved[1], 0.30, 1e-4);
}

TEST(ControlScores, RiseWithTheResidual) {
  std::vector<float> squared_distance;
  for (int i = 0; i < 40; ++i) squared_distance.push_back(i % 2 == 0 ? 0.0025f : 0.01f);
  const std::vector<float> score = ControlScores(Mixed({kPlane}, 40), squared_distance);
  EXPECT_NEAR(score[0], 0.15 * 0.5, 1e-4);  // 5 cm of the 95th percentile's 10 cm
  EXPECT_NEAR(score[1], 0.15, 1e-4);
}

TEST(ControlScores, AreLowOnWallsAndHighOnEdges) {
  std::vector<PointCovariance> scan = Mixed({Surface(0.22f, 0.2f, 0.01f)}, 80);
  for (int i = 0; i < 20; ++i) scan.push_back(Surface(0.3f, 0.05f, 0.02f));
  const std::vector<float> score = ControlScores(scan, std::vector<float>(scan.size(), 0.0f));
  EXPECT_LT(score.front(), 0.05f);
  EXPECT_GT(score.back(), 0.5f);
}

TEST(ControlScores, AreUnknownWithoutAMatchNeverZero) {
  std::vector<float> squared_distance(40, 0.01f);
  squared_distance[3] = std::numeric_limits<float>::infinity();
  squared_distance[4] = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> score = ControlScores(Mixed({kPlane, kNeedle}, 20), squared_distance);
  for (std::size_t i = 0; i < score.size(); ++i) {
    EXPECT_EQ(std::isnan(score[i]), i == 3 || i == 4) << i;
  }
}

TEST(ControlScores, AreUnknownWhereTooFewPointsMatchToNormaliseBy) {
  constexpr std::size_t kFewest = 16;
  std::vector<float> squared_distance(40, std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i + 1 < kFewest; ++i) squared_distance[i] = 0.01f;
  const std::vector<PointCovariance> scan = Mixed({kPlane, kNeedle}, 20);
  for (const float c : ControlScores(scan, squared_distance)) EXPECT_TRUE(std::isnan(c));
  squared_distance[kFewest - 1] = 0.01f;
  EXPECT_FALSE(std::isnan(ControlScores(scan, squared_distance)[0]));
}

TEST(ControlScores, AreUnknownBeforeThereIsAMap) {
  const std::vector<float> score = ControlScores(Mixed({kPlane}, 40), {});
  ASSERT_EQ(score.size(), 40u);
  for (const float c : score) EXPECT_TRUE(std::isnan(c));
}

TEST(ControlScores, DoNotDependOnTheSizeOfTheScene) {
  std::vector<PointCovariance> scan;
  std::vector<PointCovariance> doubled;
  std::vector<float> squared_distance;
  std::vector<float> doubled_distance;
  for (int i = 0; i < 100; ++i) {
    const float s = 0.1f + 0.002f * static_cast<float>(i);
    scan.push_back(Surface(0.4f, s, 0.3f * s));
    doubled.push_back(Surface(0.8f, 2.0f * s, 0.6f * s));
    squared_distance.push_back(1e-4f * static_cast<float>(i));
    doubled_distance.push_back(4e-4f * static_cast<float>(i));
  }
  const std::vector<float> score = ControlScores(scan, squared_distance);
  const std::vector<float> score_doubled = ControlScores(doubled, doubled_distance);
  for (std::size_t i = 0; i < score.size(); ++i) {
    EXPECT_NEAR(score[i], score_doubled[i], 1e-4) << i;  // the epsilons have units
  }
}

}  // namespace
}  // namespace covsplat
