#include "covsplat/core/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace covsplat::internal {

void CheckFailed(const char* expression, const char* file, int line) {
  std::fprintf(stderr, "covsplat: internal check failed at %s:%d: %s\n", file, line, expression);
  std::abort();
}

}  // namespace covsplat::internal
