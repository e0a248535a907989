#include "apps/command_line.hpp"

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(CommandLineTest, WordsThatAShellWouldSplitAreQuoted) {
  using std::string_literals::operator""s;
  EXPECT_EQ(QuoteWords("covsplat\0run\0a/b.c\0"s), "covsplat run a/b.c");
  EXPECT_EQ(QuoteWords("run\0two words\0it's\0\0"s), "run 'two words' 'it'\\''s' ''");
  EXPECT_EQ(QuoteWords(""), "");
}

}  // namespace
}  // namespace covsplat
