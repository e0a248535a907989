#include "apps/progress.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "covsplat/report/format.hpp"

namespace covsplat {
namespace {

double SteadySeconds() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

int TerminalColumns(std::FILE* out) {
  winsize size{};
  if (ioctl(fileno(out), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

double ShareDone(const ProgressStatus& status) {
  if (status.total <= 0) return 0.0;
  return std::clamp(static_cast<double>(status.done) / static_cast<double>(status.total), 0.0, 1.0);
}

/// "12.7 scan/s  78.7 ms  184 213 Gaussians  412 MB  ETA 0:21"
std::string Numbers(const ProgressStatus& status, double elapsed_s) {
  const double rate = elapsed_s > 0.0 ? static_cast<double>(status.done) / elapsed_s : 0.0;
  std::string text = fmt::format("{:.1f} {}/s  {:.1f} ms", rate, status.unit, status.ms_per_scan);
  if (status.gaussians >= 0) {
    text += fmt::format("  {} Gaussians", FormatCount(static_cast<double>(status.gaussians)));
  }
  text += "  " + FormatBytes(static_cast<double>(status.rss_bytes));
  if (status.lost > 0) text += fmt::format("  {} lost", status.lost);
  if (status.done >= status.total || rate <= 0.0) return text;
  return text + "  ETA " + FormatSeconds(static_cast<double>(status.total - status.done) / rate);
}

std::string Bar(double share, int width) {
  constexpr const char* kPart[] = {" ", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  const int eighths = static_cast<int>(std::lround(share * width * 8));
  std::string bar;
  for (int i = 0; i < width; ++i) {
    const int filled = std::clamp(eighths - 8 * i, 0, 8);
    bar += filled == 8 ? "█" : kPart[filled];
  }
  return bar;
}

std::string Counter(const ProgressStatus& status) {
  return status.total > 0 ? fmt::format("{}/{}", status.done, status.total)
                          : fmt::format("{} scans", status.done);
}

}  // namespace

std::string ProgressBar(const ProgressStatus& status, double elapsed_s, int columns) {
  constexpr int kMaxBar = 30, kMinBar = 5;
  const auto room = static_cast<std::size_t>(std::max(0, columns - 1));  // the cursor needs one
  std::string text = Counter(status) + "  " + Numbers(status, elapsed_s);
  const int percent = static_cast<int>(100.0 * ShareDone(status));
  const int width = std::min(kMaxBar, static_cast<int>(room) - static_cast<int>(text.size()) - 8);
  if (status.total <= 0 || width < kMinBar) return text.substr(0, room);
  return fmt::format("{:3}% |{}| {}", percent, Bar(ShareDone(status), width), text);
}

std::string ProgressLine(const ProgressStatus& status, double elapsed_s) {
  return fmt::format("{} {}  {}", status.unit, Counter(status), Numbers(status, elapsed_s));
}

Progress::Progress() : Progress(Options()) {}

Progress::Progress(Options options)
    : options_(std::move(options)),
      is_terminal_(options_.is_terminal.value_or(isatty(fileno(options_.out)) == 1)) {
  if (!options_.clock_s) options_.clock_s = SteadySeconds;
  start_s_ = options_.clock_s();
  last_drawn_s_ = start_s_;
}

Progress::~Progress() { Finish(); }

void Progress::Update(const ProgressStatus& status) {
  constexpr double kRedraw = 0.1, kLine = 5.0;
  status_ = status;
  drawn_ = false;
  if (options_.clock_s() - last_drawn_s_ >= (is_terminal_ ? kRedraw : kLine)) Draw();
}

void Progress::Draw() {
  drawn_ = true;
  last_drawn_s_ = options_.clock_s();
  if (options_.quiet || !status_) return;
  const double elapsed_s = last_drawn_s_ - start_s_;
  if (is_terminal_) {
    const std::string bar = ProgressBar(*status_, elapsed_s, TerminalColumns(options_.out));
    std::fprintf(options_.out, "\r\x1b[K%s", bar.c_str());
    bar_open_ = true;
  } else {
    std::fprintf(options_.out, "%s\n", ProgressLine(*status_, elapsed_s).c_str());
  }
  std::fflush(options_.out);
}

void Progress::Message(const std::string& text) {
  std::fprintf(options_.out, "%s%s\n", bar_open_ ? "\r\x1b[K" : "", text.c_str());
  if (bar_open_) Draw();
}

void Progress::Finish() {
  if (!drawn_) Draw();
  if (bar_open_) std::fprintf(options_.out, "\n");
  std::fflush(options_.out);
  bar_open_ = false;
}

}  // namespace covsplat
