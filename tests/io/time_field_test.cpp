#include "covsplat/io/time_field.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "covsplat/io/table_scan.hpp"

namespace covsplat {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<Eigen::Vector3f> Points(std::size_t count) {
  return std::vector<Eigen::Vector3f>(count, Eigen::Vector3f(1.0f, 2.0f, 3.0f));
}

Result<PointTimes> Decode(const std::vector<double>& values) {
  return DecodePointTimes(values, Points(values.size()), "scan.pcd: column t");
}

TEST(TimeField, TheSpanTellsTheUnit) {
  for (const double unit : {1.0, 1e3, 1e6, 1e9}) {
    const auto times = Decode({0.0, 0.05 * unit, 0.1 * unit});
    ASSERT_TRUE(times) << times.error().message;
    EXPECT_FALSE(times->stamp_s);
    ASSERT_EQ(times->offset_s.size(), 3u);
    EXPECT_FLOAT_EQ(times->offset_s[1], 0.05f) << unit;
  }
}

TEST(TimeField, NegativeOffsetsAreKept) {
  const auto times = Decode({-0.1, -0.05, 0.0});
  ASSERT_TRUE(times);
  EXPECT_FALSE(times->stamp_s);
  EXPECT_FLOAT_EQ(times->offset_s[0], -0.1f);
}

TEST(TimeField, AbsoluteTimesBecomeAStampAndOffsets) {
  for (const double unit : {1.0, 1e9}) {
    const double start = 1.7e9 * unit;
    const auto times = Decode({start + 0.05 * unit, start, start + 0.1 * unit});
    ASSERT_TRUE(times);
    EXPECT_DOUBLE_EQ(times->stamp_s.value(), 1.7e9);
    EXPECT_NEAR(times->offset_s[0], 0.05, 1e-6);
    EXPECT_EQ(times->offset_s[1], 0.0f);
  }
}

TEST(TimeField, PointsThatWereNotMeasuredDoNotDisturbTheUnit) {
  std::vector<Eigen::Vector3f> points = Points(4);
  points[0].setZero();
  points[2].setConstant(std::numeric_limits<float>::quiet_NaN());
  const std::vector<double> values = {0.0, 1.7e9, kNaN, 1.7e9 + 0.1};
  const auto times = DecodePointTimes(values, points, "");
  ASSERT_TRUE(times);
  EXPECT_DOUBLE_EQ(times->stamp_s.value(), 1.7e9);
  EXPECT_EQ(times->offset_s[0], 0.0f);
  EXPECT_EQ(times->offset_s[2], 0.0f);
  EXPECT_NEAR(times->offset_s[3], 0.1, 1e-6);
}

TEST(TimeField, OneAndTheSameTimeForAllPointsIsNoTimePerPoint) {
  EXPECT_TRUE(Decode({0.0, 0.0, 0.0})->offset_s.empty());
  EXPECT_FALSE(Decode({0.0, 0.0, 0.0})->stamp_s);
  EXPECT_DOUBLE_EQ(Decode({1.7e18, 1.7e18})->stamp_s.value(), 1.7e9);
  EXPECT_TRUE(Decode({})->offset_s.empty());
}

TEST(TimeField, ASpanThatFitsNoUnitIsAnErrorWithTheNumbers) {
  for (const double span : {5.0, 1500.0, 0.001, 3e9}) {
    const auto times = Decode({0.0, span});
    ASSERT_FALSE(times) << span;
    EXPECT_NE(times.error().message.find("scan.pcd: column t"), std::string::npos);
    EXPECT_NE(times.error().message.find(fmt::format("{}", span)), std::string::npos);
  }
}

TEST(TableScan, TakesTheColumnsItKnowsByName) {
  PointTable table;
  table.columns = {{"ring", std::vector<std::uint8_t>{1, 2}},
                   {"z", std::vector<float>{3.0f, 6.0f}},
                   {"x", std::vector<double>{1.0, 4.0}},
                   {"reflectivity", std::vector<std::uint16_t>{7, 8}},
                   {"y", std::vector<float>{2.0f, 5.0f}},
                   {"t", std::vector<std::uint32_t>{0, 100'000'000}}};
  const auto scan = ScanFromTable(table, "f");
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->scan.points[1], Eigen::Vector3f(4.0f, 5.0f, 6.0f));
  EXPECT_EQ(scan->scan.intensity, (std::vector<float>{7.0f, 8.0f}));
  EXPECT_FLOAT_EQ(scan->scan.time_offset_s[1], 0.1f);
  EXPECT_FALSE(scan->stamp_from_points);
}

TEST(TableScan, MissingCoordinatesAreAnErrorThatListsTheColumns) {
  PointTable table;
  table.columns = {{"x", std::vector<float>{}}, {"depth", std::vector<float>{}}};
  const auto scan = ScanFromTable(table, "f.pcd");
  ASSERT_FALSE(scan);
  EXPECT_NE(scan.error().message.find("x depth"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
