#include "apps/scan_feed.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iterator>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace covsplat {
namespace {

using Clock = std::chrono::steady_clock;

// For waits that nothing ends when `stop` begins to say so.
constexpr std::chrono::milliseconds kPatience{50};

class FileFeed : public ScanFeed {
 public:
  FileFeed(std::unique_ptr<ScanSource> source, std::int64_t jump, std::function<bool()> stop)
      : source_(std::move(source)), jump_(jump), stop_(std::move(stop)) {}

  std::optional<FedScan> Next() override {
    while (!stop_()) {
      Result<std::optional<Scan>> read = source_->Next();
      const bool wanted = taken_++ % jump_ == 0;
      if (read && !*read) return std::nullopt;
      if (!wanted) continue;
      if (!read) {
        ++counts_.damaged;
        problems_.push_back({-1, read.error().message + "; the scan is left out"});
      } else if (last_stamp_s_ && (*read)->stamp_s <= *last_stamp_s_) {
        ++counts_.backwards;
        problems_.push_back({(*read)->index, Backwards(**read)});
      } else {
        last_stamp_s_ = (*read)->stamp_s;
        return FedScan{std::move(**read), Clock::now()};
      }
    }
    return std::nullopt;
  }

  FeedCounts Counts() override { return counts_; }
  std::vector<FeedProblem> TakeProblems() override { return std::exchange(problems_, {}); }

 private:
  std::string Backwards(const Scan& scan) const {
    return fmt::format(
        "{}: its time {:.6f} s is not later than {:.6f} s of the scan before; the "
        "scan is left out",
        scan.source,
        scan.stamp_s,
        *last_stamp_s_);
  }

  std::unique_ptr<ScanSource> source_;
  const std::int64_t jump_;
  const std::function<bool()> stop_;
  std::int64_t taken_ = 0;
  std::optional<double> last_stamp_s_;
  FeedCounts counts_;
  std::vector<FeedProblem> problems_;
};

class ReadAheadFeed : public ScanFeed {
 public:
  ReadAheadFeed(std::unique_ptr<ScanFeed> feed, std::function<bool()> stop)
      : feed_(std::move(feed)), stop_(std::move(stop)) {}
  ~ReadAheadFeed() override { thread_ = {}; }  // asks it to stop and joins

  std::optional<FedScan> Next() override {
    if (ended_ || stop_()) return std::nullopt;
    if (!thread_.joinable()) {
      thread_ = std::jthread([this](const std::stop_token& token) { ReadAhead(token); });
    }
    Entry next;
    {
      std::unique_lock lock(mutex_);
      while (read_.empty() && !stop_()) news_.wait_for(lock, kPatience);
      if (read_.empty()) return std::nullopt;
      next = std::move(read_.front());
      read_.pop_front();
    }
    room_.notify_one();
    counts_ = next.counts;
    std::ranges::move(next.problems, std::back_inserter(problems_));
    ended_ = !next.scan;
    if (next.scan) next.scan->arrival = Clock::now();
    return std::move(next.scan);
  }

  FeedCounts Counts() override { return counts_; }
  std::vector<FeedProblem> TakeProblems() override { return std::exchange(problems_, {}); }

 private:
  /// A scan, none at the end, and what was known of the feed once it was read.
  struct Entry {
    std::optional<FedScan> scan;
    FeedCounts counts;
    std::vector<FeedProblem> problems;
  };

  void ReadAhead(const std::stop_token& token) {
    for (bool more = true; more;) {
      Entry entry;
      entry.scan = feed_->Next();
      entry.counts = feed_->Counts();
      entry.problems = feed_->TakeProblems();
      more = entry.scan.has_value();
      std::unique_lock lock(mutex_);
      if (!room_.wait(lock, token, [&] { return read_.size() < kMaxReadAhead; })) return;
      read_.push_back(std::move(entry));
      news_.notify_one();
    }
  }

  const std::unique_ptr<ScanFeed> feed_;  // of the thread
  const std::function<bool()> stop_;
  std::mutex mutex_;
  std::condition_variable news_;
  std::condition_variable_any room_;
  std::deque<Entry> read_;  // guarded by mutex_
  // Of the caller.
  FeedCounts counts_;
  std::vector<FeedProblem> problems_;
  bool ended_ = false;

  std::jthread thread_;  // last: joins before the rest goes
};

class RealtimeFeed : public ScanFeed {
 public:
  RealtimeFeed(std::unique_ptr<ScanFeed> feed, double rate, std::function<bool()> stop)
      : feed_(std::move(feed)), rate_(rate), stop_(std::move(stop)) {}
  ~RealtimeFeed() override { thread_ = {}; }  // asks it to stop and joins

  std::optional<FedScan> Next() override {
    if (!thread_.joinable()) {
      thread_ = std::jthread([this](const std::stop_token& token) { Deliver(token); });
    }
    std::unique_lock lock(mutex_);
    if (!waiting_.empty()) ++late_;
    while (waiting_.empty() && !ended_ && !stop_()) news_.wait_for(lock, kPatience);
    if (waiting_.empty()) return std::nullopt;
    FedScan oldest = std::move(waiting_.front());
    waiting_.pop_front();
    return oldest;
  }

  FeedCounts Counts() override {
    const std::scoped_lock lock(mutex_);
    FeedCounts counts = counts_;
    counts.late = late_;
    counts.dropped = dropped_;
    return counts;
  }
  std::vector<FeedProblem> TakeProblems() override {
    const std::scoped_lock lock(mutex_);
    return std::exchange(problems_, {});
  }

 private:
  void Deliver(const std::stop_token& token) {
    Clock::time_point start;
    std::optional<double> first_stamp_s;
    while (!token.stop_requested()) {
      std::optional<FedScan> fed = feed_->Next();
      if (!fed) break;
      if (!first_stamp_s) {
        first_stamp_s = fed->scan.stamp_s;
        start = fed->arrival;
      }
      const std::chrono::duration<double> after((fed->scan.stamp_s - *first_stamp_s) / rate_);
      const auto due = start + std::chrono::duration_cast<Clock::duration>(after);
      while (Clock::now() < due && !token.stop_requested()) {
        std::this_thread::sleep_until(std::min(due, Clock::now() + kPatience));
      }
      Put({std::move(fed->scan), due});
    }
    const std::scoped_lock lock(mutex_);
    ended_ = true;
    TakeOver();
    news_.notify_one();
  }

  void Put(FedScan scan) {
    const std::scoped_lock lock(mutex_);
    TakeOver();
    if (waiting_.size() == kMaxWaitingScans) {
      waiting_.pop_front();
      ++dropped_;
    }
    waiting_.push_back(std::move(scan));
    news_.notify_one();
  }

  void TakeOver() {
    counts_ = feed_->Counts();
    for (FeedProblem& problem : feed_->TakeProblems()) problems_.push_back(std::move(problem));
  }

  const std::unique_ptr<ScanFeed> feed_;  // of the thread
  const double rate_;
  const std::function<bool()> stop_;
  std::mutex mutex_;
  std::condition_variable news_;
  // All guarded by mutex_.
  std::deque<FedScan> waiting_;  ///< the oldest first
  bool ended_ = false;
  std::int64_t late_ = 0;
  std::int64_t dropped_ = 0;
  FeedCounts counts_;  ///< of what could not be fed
  std::vector<FeedProblem> problems_;

  std::jthread thread_;  // last: joins before the rest goes
};

}  // namespace

std::unique_ptr<ScanFeed> MakeFeed(std::unique_ptr<ScanSource> source,
                                   std::int64_t jump,
                                   std::function<bool()> stop) {
  return std::make_unique<FileFeed>(std::move(source), jump, std::move(stop));
}

std::unique_ptr<ScanFeed> MakeReadAheadFeed(std::unique_ptr<ScanFeed> feed,
                                            std::function<bool()> stop) {
  return std::make_unique<ReadAheadFeed>(std::move(feed), std::move(stop));
}

std::unique_ptr<ScanFeed> MakeRealtimeFeed(std::unique_ptr<ScanFeed> feed,
                                           double rate,
                                           std::function<bool()> stop) {
  return std::make_unique<RealtimeFeed>(std::move(feed), rate, std::move(stop));
}

}  // namespace covsplat
