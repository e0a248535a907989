#include "covsplat/core/background.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#if defined(__linux__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace covsplat {
namespace {

TEST(BackgroundPool, DoesTheWorkOfAPool) {
  const auto pool = MakeBackgroundPool(3);
  EXPECT_EQ(pool->Threads(), 3);
  std::atomic<int> sum{0};
  pool->Run(100, [&](std::size_t i) { sum += static_cast<int>(i); });
  EXPECT_EQ(sum, 4950);
}

#if defined(__linux__)
int NiceOfThisThread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(GoToBackground, ConcernsThisThreadAndThoseThatItStarts) {
  const int before = NiceOfThisThread();
  int own = 0;
  int of_child = 0;
  std::jthread([&] {
    GoToBackground();
    own = NiceOfThisThread();
    std::jthread([&] { of_child = NiceOfThisThread(); }).join();
  }).join();
  EXPECT_GE(own, std::min(before + 1, 19));
  EXPECT_EQ(of_child, own);
  EXPECT_EQ(NiceOfThisThread(), before);
}

TEST(GoToBackground, MakingAPoolLeavesTheCallerWhereItIs) {
  const int before = NiceOfThisThread();
  const auto pool = MakeBackgroundPool(2);
  EXPECT_EQ(NiceOfThisThread(), before);
}
#endif

}  // namespace
}  // namespace covsplat
