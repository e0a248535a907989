// ScanFeed: the scans of a recording as a run takes them, with what went wrong on the way.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "covsplat/io/scan_source.hpp"

namespace covsplat {

struct FeedCounts {
  std::int64_t damaged = 0;    ///< could not be read
  std::int64_t backwards = 0;  ///< not later than the scan before
  std::int64_t late = 0;       ///< came while the tracker was busy, and waited for it
  std::int64_t dropped = 0;    ///< waited and were overtaken by newer ones
};

struct FeedProblem {
  std::int64_t scan = -1;  ///< -1: not known
  std::string text;
};

struct FedScan {
  Scan scan;
  /// When the recording had it: in real time the moment that its stamp stands for, however late it
  /// is taken; else the moment in which it is handed out.
  std::chrono::steady_clock::time_point arrival;
};

/// One caller's thread.
class ScanFeed {
 public:
  virtual ~ScanFeed() = default;
  /// The next usable scan; nothing at the end or when `stop` says so.
  virtual std::optional<FedScan> Next() = 0;
  virtual FeedCounts Counts() = 0;
  /// What went wrong since the last call.
  virtual std::vector<FeedProblem> TakeProblems() = 0;
};

/// Every `jump`-th scan, as fast as it is asked for.
std::unique_ptr<ScanFeed> MakeFeed(std::unique_ptr<ScanSource> source,
                                   std::int64_t jump,
                                   std::function<bool()> stop);

/// So many scans are read before they are asked for.
inline constexpr std::size_t kMaxReadAhead = 10;

/// The scans of another feed, read ahead in a thread of its own from the first call on, so that
/// files that are slow for a moment keep nobody waiting. What went wrong is told, and counted, when
/// the scan after it is handed out.
std::unique_ptr<ScanFeed> MakeReadAheadFeed(std::unique_ptr<ScanFeed> feed,
                                            std::function<bool()> stop);

/// So many scans wait to be taken in real time: one delay costs none, and who is always too slow is
/// not far behind.
inline constexpr std::size_t kMaxWaitingScans = 2;

/// The scans of another feed at the times of their stamps, from the first call on, `rate` times as
/// fast. The newest kMaxWaitingScans wait; older ones are dropped.
std::unique_ptr<ScanFeed> MakeRealtimeFeed(std::unique_ptr<ScanFeed> feed,
                                           double rate,
                                           std::function<bool()> stop);

}  // namespace covsplat
