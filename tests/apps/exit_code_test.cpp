#include "apps/exit_code.hpp"

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(ExitCode, IsTheDocumentedOne) {
  EXPECT_EQ(ExitCodeOf(ErrorCode::kUsage), 2);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kInput), 3);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kOutput), 4);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kUnavailable), 5);
}

TEST(ExitCode, ErrorsStartWithTheProgramsName) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = open_memstream(&text, &size);
  EXPECT_EQ(ReportError({ErrorCode::kInput, "a.bin: 100% broken"}, out), 3);
  ReportWarning("careful", out);
  std::fclose(out);
  EXPECT_STREQ(text, "covsplat: error: a.bin: 100% broken\ncovsplat: warning: careful\n");
  std::free(text);
}

}  // namespace
}  // namespace covsplat
