#include "apps/progress.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

constexpr ProgressStatus kHalf{210, 420, 78.7, 184213, 412000000, 0};

/// A progress that writes to memory under a clock of the test.
class ProgressTest : public testing::Test {
 protected:
  ~ProgressTest() override {
    std::fclose(out_);
    std::free(text_);
  }

  Progress::Options Options(bool is_terminal) {
    return {out_, is_terminal, false, [this] { return now_s_; }};
  }
  std::string Text() {
    std::fflush(out_);
    return {text_, size_};
  }

  double now_s_ = 100.0;
  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* out_ = open_memstream(&text_, &size_);
};

std::size_t Letters(const std::string& utf8) {
  std::size_t letters = 0;
  for (const char c : utf8) letters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1U : 0U;
  return letters;
}

TEST(ProgressText, NamesSpeedSizeAndTimeLeft) {
  EXPECT_EQ(ProgressLine(kHalf, 21.0),
            "scan 210/420  10.0 scan/s  78.7 ms  184 213 Gaussians  412 MB  ETA 21.0 s");
  EXPECT_EQ(ProgressLine({3, 0, 5.0, 10, 1000, 2}, 1.0),
            "scan 3 scans  3.0 scan/s  5.0 ms  10 Gaussians  1.00 kB  2 lost");
}

TEST(ProgressText, BarFitsTheTerminal) {
  for (int columns = 0; columns < 250; ++columns) {
    EXPECT_LE(Letters(ProgressBar(kHalf, 21.0, columns)), static_cast<std::size_t>(columns));
  }
  const std::string bar = ProgressBar(kHalf, 21.0, 120);
  EXPECT_TRUE(bar.starts_with(" 50% |█")) << bar;
}

TEST_F(ProgressTest, LogsGetALineEveryFiveSecondsAndTheLastOne) {
  {
    Progress progress(Options(false));
    for (int i = 1; i <= 121; ++i) {
      now_s_ += 0.1;
      progress.Update({i, 121, 100.0, 1, 1, 0});
    }
  }
  const std::string text = Text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3) << text;
  EXPECT_NE(text.find("121/121"), std::string::npos);
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST_F(ProgressTest, TerminalRedrawsOneLine) {
  Progress progress(Options(true));
  for (int i = 0; i < 100; ++i) {
    now_s_ += 0.01;
    progress.Update(kHalf);
  }
  const std::string before = Text();
  EXPECT_EQ(std::count(before.begin(), before.end(), '\n'), 0);
  EXPECT_LE(std::count(before.begin(), before.end(), '\r'), 10);
  progress.Message("note");
  EXPECT_NE(Text().find("\r\x1b[Knote\n"), std::string::npos);
  progress.Finish();
  progress.Finish();
  EXPECT_TRUE(Text().ends_with("\n"));
}

}  // namespace
}  // namespace covsplat
