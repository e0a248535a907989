#include "covsplat/core/parallel.hpp"

#include <atomic>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(Parallel, EveryIndexIsVisitedOnce) {
  for (const int threads : {1, 2, 5}) {
    ThreadPool pool(threads);
    std::vector<std::atomic<int>> visits(1000);
    for (int repeat = 0; repeat < 50; ++repeat) {
      ParallelFor(pool, visits.size(), 7, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) visits[i]++;
      });
    }
    for (const auto& count : visits) EXPECT_EQ(count, 50);
  }
}

TEST(Parallel, SumsAreTheSameBitsForAnyThreadCount) {
  std::vector<float> values(100'003);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = 1.0f / static_cast<float>(i + 1);
  }
  const auto sum = [&](int threads) {
    ThreadPool pool(threads);
    return ParallelSum(pool, values.size(), 1024, 0.0f, [&](std::size_t begin, std::size_t end) {
      float part = 0.0f;
      for (std::size_t i = begin; i < end; ++i) part += values[i];
      return part;
    });
  };
  EXPECT_EQ(sum(1), sum(2));
  EXPECT_EQ(sum(1), sum(7));
}

TEST(Parallel, NothingToDoIsNotAnError) {
  ThreadPool pool(3);
  ParallelFor(pool, 0, 16, [](std::size_t, std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace covsplat
