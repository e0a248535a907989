#include <cmath>

#include "tests/support/registration_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

Eigen::Matrix3f Full(const Eigen::Matrix<float, 6, 1>& v) {
  Eigen::Matrix3f m;
  m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
  return m;
}

TEST(RegistrationTarget, HoldsTheCovarianceOfAThinSurfelWhateverTheOrderOfItsScales) {
  const Eigen::Quaternionf rotation = MakePose(0.3, -0.7, 1.9, 0, 0, 0).Rotation().cast<float>();
  const Eigen::Matrix3f R = rotation.toRotationMatrix();
  const TargetSurfel surfels[] = {{.rotation = rotation, .scale0 = 0.6f, .scale1 = 0.2f},
                                  {.mean = {1, 0, 0},
                                   .rotation = Eigen::Quaternionf(3.0f * rotation.coeffs()),
                                   .scale0 = 0.2f,
                                   .scale1 = 0.6f},
                                  {.mean = {2, 0, 0}, .rotation = rotation, .scale1 = 0.0f}};
  const RegistrationTarget target(surfels, Eigen::Vector3d::Zero(), 7);
  ASSERT_EQ(target.Size(), 3u);
  EXPECT_EQ(target.Keyframes(), 7);
  const Eigen::Matrix3f expected[] = {
      R * Eigen::Vector3f(9.0f, 1.0f, 1e-3f).asDiagonal() * R.transpose(),
      R * Eigen::Vector3f(1.0f, 9.0f, 1e-3f).asDiagonal() * R.transpose(),
      R * Eigen::Vector3f(100.0f, 1.0f, 1e-3f).asDiagonal() * R.transpose()};
  for (int slot = 0; slot < 3; ++slot) {
    const auto surfel = static_cast<std::size_t>(target.SurfelOf(slot));
    EXPECT_LT((Full(target.At(slot).covariance) - expected[surfel]).norm(),
              1e-5f * expected[surfel].norm());
    EXPECT_LT((target.At(slot).normal - R.col(2)).norm(), 1e-5f);
    EXPECT_EQ(target.At(slot).mean, surfels[surfel].mean);
  }
}

TEST(RegistrationTarget, LeavesOutBrokenSurfels) {
  const float nan = std::nanf("");
  const TargetSurfel surfels[] = {{.mean = {nan, 0, 0}},
                                  {.rotation = Eigen::Quaternionf(0, 0, 0, 0)},
                                  {.scale0 = nan},
                                  {.weight = nan},
                                  {.mean = {1, 2, 3}}};
  const RegistrationTarget target(surfels, Eigen::Vector3d::Zero(), 1);
  ASSERT_EQ(target.Size(), 1u);
  EXPECT_EQ(target.SurfelOf(0), 4);
}

}  // namespace
}  // namespace covsplat::test
