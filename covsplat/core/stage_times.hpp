// StageTimes: how long the named stages of one scan or iteration took.
#pragma once

#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

namespace covsplat {

/// Milliseconds by stage name, in order of first use. Stage names must outlive it (literals).
class StageTimes {
 public:
  void Add(std::string_view stage, double ms) {
    for (auto& [name, total] : stages_) {
      if (name == stage) {
        total += ms;
        return;
      }
    }
    stages_.emplace_back(stage, ms);
  }
  double Of(std::string_view stage) const {
    for (const auto& [name, total] : stages_) {
      if (name == stage) return total;
    }
    return 0.0;
  }
  const std::vector<std::pair<std::string_view, double>>& Stages() const { return stages_; }

 private:
  std::vector<std::pair<std::string_view, double>> stages_;
};

/// Adds the time from its construction to its destruction to a stage.
class ScopedTimer {
 public:
  ScopedTimer(StageTimes& times, std::string_view stage) : times_(times), stage_(stage) {}
  ~ScopedTimer() {
    const std::chrono::duration<double, std::milli> elapsed = Clock::now() - start_;
    times_.Add(stage_, elapsed.count());
  }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  StageTimes& times_;
  std::string_view stage_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace covsplat
