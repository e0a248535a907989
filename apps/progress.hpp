// The progress of a run on the terminal.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>

namespace covsplat {

struct ProgressStatus {
  std::int64_t done = 0;
  std::int64_t total = 0;  ///< 0 if it is not known
  double ms_per_scan = 0.0;
  std::int64_t gaussians = 0;  ///< negative: there is no map
  std::int64_t rss_bytes = 0;
  std::int64_t lost = 0;
  const char* unit = "scan";  ///< what is counted
};

/// One line of at most `columns` letters with a bar. Below about 40 columns the bar goes first,
/// then the right end of the numbers.
std::string ProgressBar(const ProgressStatus& status, double elapsed_s, int columns);

/// The same numbers without a bar, for logs.
std::string ProgressLine(const ProgressStatus& status, double elapsed_s);

/// On a terminal redraws one line up to ten times a second, elsewhere prints a line every five
/// seconds. For one thread.
class Progress {
 public:
  struct Options {
    std::FILE* out = stderr;
    std::optional<bool> is_terminal;  ///< asks the system if not given
    bool quiet = false;
    std::function<double()> clock_s;  ///< seconds of a steady clock; the system's if not given
  };

  Progress();
  explicit Progress(Options options);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Update(const ProgressStatus& status);

  /// Prints a line of its own without breaking the bar.
  void Message(const std::string& text);

  /// Shows the last status for good; called by the destructor too.
  void Finish();

 private:
  void Draw();

  Options options_;
  bool is_terminal_;
  double start_s_;
  double last_drawn_s_;
  std::optional<ProgressStatus> status_;
  bool drawn_ = true;      // what Update brought last is on the screen
  bool bar_open_ = false;  // the cursor is behind a bar
};

}  // namespace covsplat
