#include "covsplat/io/name_stamp.hpp"

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

#include "covsplat/io/scan_source.hpp"

namespace covsplat {
namespace {

TEST(NameStampTest, KnowsTheNamesOfTheUsualExporters) {
  EXPECT_DOUBLE_EQ(StampOfName("1625135858.123456789").value_or(0.0), 1625135858.123456789);
  EXPECT_DOUBLE_EQ(StampOfName("cloud_1710338090_123456789").value_or(0.0), 1710338090.123456789);
  EXPECT_DOUBLE_EQ(StampOfName("1710338090_5").value_or(0.0), 1710338090.000000005);
  EXPECT_DOUBLE_EQ(StampOfName("1625135858123456789").value_or(0.0), 1625135858.123456789);
  EXPECT_DOUBLE_EQ(StampOfName("1625135858123456").value_or(0.0), 1625135858.123456);
  EXPECT_DOUBLE_EQ(StampOfName("1625135858123").value_or(0.0), 1625135858.123);
}

TEST(NameStampTest, OtherNumbersAreNoTimes) {
  for (const char* stem : {"",
                           "000012",
                           "0000000012",
                           "1625135858",
                           "scan_12",
                           "a.b",
                           ".",
                           "1625135858.",
                           "16251358.5",
                           "1625135858.1e5",
                           "_",
                           "__",
                           "1625135858_1234567890",
                           "1625135858.nan",
                           "162513585812345678x"}) {
    EXPECT_FALSE(StampOfName(stem)) << stem;
  }
}

TEST(NameStampTest, AllNamesOrNone) {
  EXPECT_EQ(StampsOfNames({"1625135858.1.pcd", "1625135858.2.pcd"}).size(), 2U);
  EXPECT_TRUE(StampsOfNames({"1625135858.1.pcd", "map.pcd"}).empty());
  EXPECT_TRUE(StampsOfNames({"1625135858.2.pcd", "1625135858.1.pcd"}).empty());
}

TEST(NameStampTest, ScansHaveTheTimesOfTheirNames) {
  const TemporaryFolder folder;
  const std::string scan =
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
      "POINTS 1\nDATA ascii\n1 2 3\n";
  folder.Put("1625135858.100000000.pcd", scan);
  folder.Put("1625135858.200000000.pcd", scan);
  const auto source = OpenScanSource(folder.Path(), {});
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_NE((*source)->Description().find("times for names"), std::string::npos);
  for (const double stamp_s : {1625135858.1, 1625135858.2}) {
    const auto next = (*source)->Next();
    ASSERT_TRUE(next && *next);
    EXPECT_DOUBLE_EQ((*next)->stamp_s, stamp_s);
  }
}

}  // namespace
}  // namespace covsplat
