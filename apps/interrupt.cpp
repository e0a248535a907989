#include "apps/interrupt.hpp"

#include <atomic>
#include <cerrno>
#include <string_view>

#include "apps/exit_code.hpp"
#include <unistd.h>

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

// Signal handlers reach nothing but globals; lock-free atomics are allowed in them.
std::atomic<int> signals_seen{0};
std::atomic<bool> guarded{false};
static_assert(std::atomic<int>::is_always_lock_free);

constexpr std::string_view kNotice =
    "\ncovsplat: finishing with what there is; press Ctrl-C again to stop at once\n";

extern "C" void OnSignal(int) {
  const int saved_errno = errno;
  if (signals_seen.fetch_add(1) > 0) _exit(kExitInterrupted);
  const ssize_t written = write(STDERR_FILENO, kNotice.data(), kNotice.size());
  static_cast<void>(written);
  errno = saved_errno;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  COVSPLAT_CHECK(!guarded.exchange(true));
  signals_seen = 0;
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_int_);
  sigaction(SIGTERM, &action, &old_term_);
}

InterruptGuard::~InterruptGuard() {
  sigaction(SIGINT, &old_int_, nullptr);
  sigaction(SIGTERM, &old_term_, nullptr);
  guarded = false;
}

bool Interrupted() { return signals_seen.load() > 0; }

}  // namespace covsplat
