#include "covsplat/core/se3.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

constexpr double kTolerance = 1e-12;

Vector6d RandomTwist(Rng& rng, double rotation, double translation) {
  Vector6d xi;
  for (int i = 0; i < 3; ++i) xi[i] = rotation * rng.Uniform(-1.0, 1.0);
  for (int i = 3; i < 6; ++i) xi[i] = translation * rng.Uniform(-1.0, 1.0);
  return xi;
}

TEST(SE3, LogInvertsExpFromTinyToNearlyHalfATurn) {
  Rng rng(1);
  for (const double scale : {1e-9, 1e-5, 1e-3, 0.1, 1.0, 1.8}) {
    for (int i = 0; i < 100; ++i) {
      const Vector6d xi = RandomTwist(rng, scale, 10.0);
      EXPECT_LT((SE3::Exp(xi).Log() - xi).norm(), 1e-9) << "scale " << scale;
    }
  }
}

TEST(SE3, ProductMatchesMatrixProduct) {
  Rng rng(2);
  const SE3 a = SE3::Exp(RandomTwist(rng, 2.0, 5.0));
  const SE3 b = SE3::Exp(RandomTwist(rng, 2.0, 5.0));
  EXPECT_LT(((a * b).Matrix() - a.Matrix() * b.Matrix()).norm(), kTolerance);
  EXPECT_LT(((a * a.Inverse()).Matrix() - Eigen::Matrix4d::Identity()).norm(), kTolerance);
}

TEST(SE3, AdjointMovesATwistToTheOtherSide) {
  Rng rng(3);
  const SE3 t = SE3::Exp(RandomTwist(rng, 1.0, 3.0));
  const Vector6d xi = RandomTwist(rng, 0.5, 0.5);
  const SE3 left = SE3::Exp(t.Adjoint() * xi) * t;
  const SE3 right = t * SE3::Exp(xi);
  EXPECT_LT((left.Matrix() - right.Matrix()).norm(), kTolerance);
}

TEST(SE3, InterpolateHitsBothEndsAndTheMiddle) {
  Rng rng(4);
  const SE3 a = SE3::Exp(RandomTwist(rng, 1.0, 3.0));
  const SE3 b = SE3::Exp(RandomTwist(rng, 1.0, 3.0));
  EXPECT_LT((Interpolate(a, b, 0.0).Matrix() - a.Matrix()).norm(), kTolerance);
  EXPECT_LT((Interpolate(a, b, 1.0).Matrix() - b.Matrix()).norm(), kTolerance);
  const SE3 middle = Interpolate(a, b, 0.5);
  const Vector6d first = (a.Inverse() * middle).Log();
  const Vector6d second = (middle.Inverse() * b).Log();
  EXPECT_LT((first - second).norm(), 1e-10);
}

TEST(SE3, InverseRightJacobianIsTheSlopeOfLog) {
  Rng rng(6);
  constexpr double kStep = 1e-6;
  // Both sides of where the series ends, and near half a turn.
  for (const double angle : {1e-9, 1e-3, 0.19999, 0.20001, 1.0, 3.0}) {
    Vector6d xi = RandomTwist(rng, 1.0, 10.0);
    xi.head<3>() *= angle / xi.head<3>().norm();
    Matrix6d slopes;
    for (int k = 0; k < 6; ++k) {
      const Vector6d d = kStep * Vector6d::Unit(k);
      slopes.col(k) =
          ((SE3::Exp(xi) * SE3::Exp(d)).Log() - (SE3::Exp(xi) * SE3::Exp(-d)).Log()) / (2 * kStep);
    }
    EXPECT_LT((InverseRightJacobian(xi) - slopes).norm(), 1e-7 * slopes.norm()) << angle;
  }
}

TEST(SE3, InverseRightJacobianIsSmoothWhereItsSeriesEnds) {
  Vector6d below = (Vector6d() << 0.12, -0.16, 0.0, 3.0, -5.0, 2.0).finished();  // 0.2 rad
  Vector6d above = below;
  below.head<3>() *= 1.0 - 1e-9;
  above.head<3>() *= 1.0 + 1e-9;
  EXPECT_LT((InverseRightJacobian(above) - InverseRightJacobian(below)).norm(), 1e-8);
}

TEST(SE3, FromMatrixFindsTheNearestRigidTransform) {
  Rng rng(5);
  const SE3 truth = SE3::Exp(RandomTwist(rng, 1.0, 3.0));
  Eigen::Matrix4d skewed = truth.Matrix();
  skewed(0, 1) += 1e-6;
  const SE3 fixed = SE3::FromMatrix(skewed);
  EXPECT_NEAR(fixed.RotationMatrix().determinant(), 1.0, kTolerance);
  EXPECT_LT((fixed.Matrix() - truth.Matrix()).norm(), 1e-5);
}

TEST(SE3, StaysRigidOverAMillionProducts) {
  const SE3 step = SE3::Exp((Vector6d() << 1e-3, 2e-3, -1e-3, 0.0, 0.0, 0.0).finished());
  SE3 t;
  for (int i = 0; i < 1'000'000; ++i) t = t * step;
  EXPECT_NEAR(t.Rotation().norm(), 1.0, kTolerance);
}

}  // namespace
}  // namespace covsplat
