#include "covsplat/mapping/saved_map.hpp"

#include <cmath>

#include "tests/support/random_map.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(SavedMap, SomeRowsKeepEverythingInTheirOrder) {
  const SavedMap map = test::RandomMap(10, 5.0, 1);
  const std::vector<std::size_t> rows = {7, 2};
  const SavedMap chosen = SelectRows(map, rows);
  ASSERT_EQ(chosen.Size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    for (int p = 0; p < kParameterCount; ++p) {
      EXPECT_EQ(chosen.gaussians.Column(p)[i], map.gaussians.Column(p)[rows[i]]);
    }
    EXPECT_EQ(chosen.confidence[i], map.confidence[rows[i]]);
    EXPECT_EQ(chosen.control_score[i], map.control_score[rows[i]]);
    EXPECT_EQ(chosen.intensity[i], map.intensity[rows[i]]);
    EXPECT_EQ(chosen.keyframe[i], map.keyframe[rows[i]]);
    EXPECT_EQ(chosen.last_seen[i], map.last_seen[rows[i]]);
  }
  EXPECT_EQ(chosen.keyframes.size(), map.keyframes.size());
  EXPECT_EQ(chosen.config_yaml, map.config_yaml);
}

TEST(SavedMap, TheThinnestAxisBecomesTheNormal) {
  const Eigen::Quaternionf rotation = Eigen::Quaternionf(0.9f, 0.1f, -0.3f, 0.2f).normalized();
  for (int thin = 0; thin < 3; ++thin) {
    Eigen::Vector3f log_scale(std::log(0.4f), std::log(0.3f), std::log(0.2f));
    log_scale[thin] = std::log(0.001f);
    SavedMap map;
    map.Resize(1);
    SetRow(map, 0, Eigen::Vector3f::Zero(), rotation, log_scale, 0.0f);
    EXPECT_TRUE(NormalOf(map.gaussians, 0).isApprox(rotation * Eigen::Vector3f::Unit(thin), 1e-5f));
    const Eigen::Matrix3f R = rotation.toRotationMatrix();
    const Eigen::Vector3f variance = (2.0f * log_scale).array().exp();
    const Eigen::Matrix3f covariance = R * variance.asDiagonal() * R.transpose();
    EXPECT_LT((test::CovarianceOf(map, 0).cast<float>() - covariance).norm(), 1e-5f) << thin;
  }
}

}  // namespace
}  // namespace covsplat
