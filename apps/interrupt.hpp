// Ctrl-C: the first one asks the run to finish, the second one ends the program.
#pragma once

#include <csignal>

namespace covsplat {

/// Catches SIGINT and SIGTERM while it lives, then restores what was there before. One at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
};

/// Whether a signal came since the guard was made; from any thread.
bool Interrupted();

}  // namespace covsplat
