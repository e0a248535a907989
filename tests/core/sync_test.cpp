#include "covsplat/core/sync.hpp"

#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(BoundedQueue, KeepsOrderAcrossThreadsAndDrainsAfterClose) {
  BoundedQueue<int> queue(2);
  std::jthread producer([&] {
    for (int i = 0; i < 1000; ++i) queue.Push(i);
    queue.Close();
  });
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(queue.Pop(), i);
  EXPECT_EQ(queue.Pop(), std::nullopt);
  EXPECT_FALSE(queue.Push(1));
}

TEST(BoundedQueue, TryPopNeverWaits) {
  BoundedQueue<int> queue(2);
  EXPECT_EQ(queue.TryPop(), std::nullopt);
  queue.Push(7);
  EXPECT_EQ(queue.TryPop(), 7);
}

TEST(Latest, ReadersSeeTheNewestValueAndKeepTheirs) {
  Latest<int> latest;
  EXPECT_EQ(latest.Get(), nullptr);
  latest.Publish(std::make_shared<const int>(1));
  const auto held = latest.Get();
  latest.Publish(std::make_shared<const int>(2));
  EXPECT_EQ(*held, 1);
  EXPECT_EQ(*latest.Get(), 2);
}

TEST(Latest, CanBeWaitedForUntilItIsGoodEnough) {
  Latest<int> latest;
  std::jthread writer([&] {
    for (int i = 0; i <= 100; ++i) latest.Publish(std::make_shared<const int>(i));
  });
  latest.WaitFor([](int value) { return value >= 100; });
  EXPECT_EQ(*latest.Get(), 100);
}

}  // namespace
}  // namespace covsplat
