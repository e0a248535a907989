#include "covsplat/report/error_picture.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "covsplat/report/colormap.hpp"

namespace covsplat {
namespace {

TEST(ErrorPicture, ColumnsShowTheirMeanErrorWithYUp) {
  // The corners of 2 x 1 m; two points one above the other at the origin.
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {0, 0, 3}, {2, 0, 0}, {2, 1, 0}};
  const std::vector<float> errors_m = {0.0f, 0.125f, 5.0f, 0.0f};
  const Image<Rgb> picture = DrawErrorsFromAbove(points, errors_m, 0.125, 201);
  ASSERT_EQ(picture.Columns(), 201);
  ASSERT_EQ(picture.Rows(), 101);
  EXPECT_EQ(picture(100, 0), DivergingColor(0.5));
  EXPECT_EQ(picture(100, 200), DivergingColor(1.0));
  EXPECT_EQ(picture(0, 200), DivergingColor(0.0));
  EXPECT_EQ(picture(0, 0), kNoDataColor);
}

TEST(ErrorPicture, PointsThatAreNotFiniteAreLeftOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {nan, 0, 0}};
  EXPECT_EQ(DrawErrorsFromAbove(points, std::vector<float>(2), 0.1, 11).Size(), 1u);
  EXPECT_TRUE(DrawErrorsFromAbove({}, {}, 0.1, 11).Empty());
}

}  // namespace
}  // namespace covsplat
