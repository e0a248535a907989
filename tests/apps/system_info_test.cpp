#include "apps/system_info.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(MemoryUse, ReadsTheTwoLines) {
  const MemoryUse use = ParseMemoryUse("Name:\tx\nVmHWM:\t  2000 kB\nVmRSS:\t  1500 kB\nodd\n");
  EXPECT_EQ(use.rss_bytes, 1500 * 1024);
  EXPECT_EQ(use.peak_rss_bytes, 2000 * 1024);
  EXPECT_EQ(ParseMemoryUse("").rss_bytes, 0);
}

TEST(MemoryUse, GrowsWithWhatIsUsed) {
  const MemoryUse before = ReadMemoryUse();
  const std::vector<char> block(64 << 20, 1);
  const MemoryUse after = ReadMemoryUse();
  EXPECT_GT(after.rss_bytes, before.rss_bytes + (32 << 20));
  EXPECT_GE(after.peak_rss_bytes, after.rss_bytes);
  EXPECT_EQ(block.back(), 1);
}

TEST(Machine, HasAProcessor) {
  EXPECT_GE(CpuCount(), 1);
  EXPECT_NE(MachineName().find("CPU"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
