#include "covsplat/core/background.hpp"

#include <algorithm>
#include <thread>

#if defined(__linux__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace covsplat {
namespace {

// About a third of the share of others. With more of it, whoever waits for a background thread
// would wait for long on a machine that is also busy with something else.
[[maybe_unused]] constexpr int kNicer = 5;
[[maybe_unused]] constexpr int kNicest = 19;

}  // namespace

void GoToBackground() {
#if defined(__linux__)
  // On Linux each thread has its own, contrary to POSIX. If it is refused, all run alike.
  const auto thread = static_cast<id_t>(gettid());
  const int nice = std::min(getpriority(PRIO_PROCESS, thread) + kNicer, kNicest);
  [[maybe_unused]] const int refused = setpriority(PRIO_PROCESS, thread, nice);
#endif
}

std::unique_ptr<ThreadPool> MakeBackgroundPool(int threads) {
  std::unique_ptr<ThreadPool> pool;
  // Threads inherit it from the one that starts them.
  std::jthread([&] {
    GoToBackground();
    pool = std::make_unique<ThreadPool>(threads);
  }).join();
  return pool;
}

}  // namespace covsplat
