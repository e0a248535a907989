// Checks of our own invariants. A failed check is a bug in covsplat: it prints and aborts.
#pragma once

namespace covsplat::internal {
[[noreturn]] void CheckFailed(const char* expression, const char* file, int line);
}  // namespace covsplat::internal

/// Always on; for module borders.
#define COVSPLAT_CHECK(condition)     \
  ((condition) ? static_cast<void>(0) \
               : ::covsplat::internal::CheckFailed(#condition, __FILE__, __LINE__))

/// For inner loops: on in debug builds only.
#ifdef NDEBUG
#define COVSPLAT_DCHECK(condition) static_cast<void>(0)
#else
#define COVSPLAT_DCHECK(condition) COVSPLAT_CHECK(condition)
#endif
