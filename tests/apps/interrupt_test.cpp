#include "apps/interrupt.hpp"

#include <csignal>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(Interrupt, FirstSignalOnlySetsTheFlag) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const InterruptGuard guard;
    EXPECT_FALSE(Interrupted());
    std::raise(signal);
    EXPECT_TRUE(Interrupted());
  }
}

TEST(Interrupt, SecondSignalEndsTheProgramAtOnce) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        const InterruptGuard guard;
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      testing::ExitedWithCode(130),
      "finishing with what there is");
}

TEST(Interrupt, TheOldHandlersComeBack) {
  struct sigaction before {};
  struct sigaction after {};
  sigaction(SIGINT, nullptr, &before);
  { const InterruptGuard guard; }
  sigaction(SIGINT, nullptr, &after);
  EXPECT_EQ(before.sa_handler, after.sa_handler);
}

}  // namespace
}  // namespace covsplat
