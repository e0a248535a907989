#include "apps/scan_feed.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

/// One scan per stamp; a negative stamp is a scan that cannot be read.
class FakeSource : public ScanSource {
 public:
  explicit FakeSource(std::vector<double> stamps) : stamps_(std::move(stamps)) {}

  Result<std::optional<Scan>> Next() override {
    if (next_ == stamps_.size()) return std::optional<Scan>();
    Scan scan;
    scan.index = static_cast<std::int64_t>(next_);
    scan.stamp_s = stamps_[next_++];
    if (scan.stamp_s < 0.0) return Fail(ErrorCode::kInput, "scan {}: is damaged", scan.index);
    return scan;
  }
  std::int64_t ScanCount() const override { return static_cast<std::int64_t>(stamps_.size()); }
  std::string Description() const override { return "fake"; }

 private:
  std::vector<double> stamps_;
  std::size_t next_ = 0;
};

std::unique_ptr<ScanFeed> FeedOf(std::vector<double> stamps, std::int64_t jump = 1) {
  return MakeFeed(std::make_unique<FakeSource>(std::move(stamps)), jump, [] { return false; });
}

std::vector<double> EvenStamps(int count, double period_s) {
  std::vector<double> stamps(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) stamps[static_cast<std::size_t>(i)] = period_s * i;
  return stamps;
}

std::vector<std::int64_t> Drain(ScanFeed& feed) {
  std::vector<std::int64_t> scans;
  while (const auto fed = feed.Next()) scans.push_back(fed->scan.index);
  return scans;
}

TEST(ScanFeedTest, LeavesOutDamagedScansAndThoseThatAreNotLater) {
  const auto feed = FeedOf({0.0, 0.1, -1.0, 0.05, 0.1, 0.2});
  EXPECT_EQ(Drain(*feed), (std::vector<std::int64_t>{0, 1, 5}));
  EXPECT_EQ(feed->Counts().damaged, 1);
  EXPECT_EQ(feed->Counts().backwards, 2);
  const std::vector<FeedProblem> problems = feed->TakeProblems();
  ASSERT_EQ(problems.size(), 3u);
  EXPECT_NE(problems[0].text.find("is damaged"), std::string::npos);
  EXPECT_EQ(problems[1].scan, 3);
  EXPECT_TRUE(feed->TakeProblems().empty());
}

TEST(ScanFeedTest, JumpCountsAllScans) {
  const auto feed = FeedOf({0.0, 0.1, 0.2, -1.0, 0.4, 0.5, 0.6}, 3);
  EXPECT_EQ(Drain(*feed), (std::vector<std::int64_t>{0, 6}));
  EXPECT_EQ(feed->Counts().damaged, 1);
}

TEST(ScanFeedTest, StopEndsIt) {
  const auto feed =
      MakeFeed(std::make_unique<FakeSource>(std::vector{0.0, 0.1}), 1, [] { return true; });
  EXPECT_FALSE(feed->Next());
}

/// Takes a moment for each scan, and counts those that were read.
class SlowSource : public FakeSource {
 public:
  SlowSource(std::vector<double> stamps, std::atomic<int>& read)
      : FakeSource(std::move(stamps)), read_(read) {}

  Result<std::optional<Scan>> Next() override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ++read_;
    return FakeSource::Next();
  }

 private:
  std::atomic<int>& read_;
};

TEST(ScanFeedTest, ReadAheadHandsOutTheSameAndTellsOfProblemsInTheirPlace) {
  const std::vector<double> stamps = {0.0, 0.1, -1.0, 0.05, 0.2, 0.3, -1.0};
  const auto plain = FeedOf(stamps);
  const auto ahead = MakeReadAheadFeed(FeedOf(stamps), [] { return false; });
  for (bool more = true; more;) {
    const auto expected = plain->Next();
    const auto fed = ahead->Next();
    more = fed.has_value();
    ASSERT_EQ(more, expected.has_value());
    if (more) {
      EXPECT_EQ(fed->scan.index, expected->scan.index);
    }
    EXPECT_EQ(ahead->Counts().damaged, plain->Counts().damaged);
    EXPECT_EQ(ahead->Counts().backwards, plain->Counts().backwards);
    EXPECT_EQ(ahead->TakeProblems().size(), plain->TakeProblems().size());
  }
  EXPECT_FALSE(ahead->Next());
}

TEST(ScanFeedTest, ReadAheadIsBoundedAndCanBeAbandoned) {
  std::atomic<int> read = 0;
  auto source = std::make_unique<SlowSource>(EvenStamps(200, 0.1), read);
  const auto never = [] { return false; };
  const auto feed = MakeReadAheadFeed(MakeFeed(std::move(source), 1, never), never);
  ASSERT_TRUE(feed->Next());
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_GT(read, 5);
  EXPECT_LE(read, static_cast<int>(kMaxReadAhead) + 2) << "one is out, one in the reader's hand";
  ASSERT_TRUE(feed->Next());
}

TEST(ScanFeedTest, ReadAheadStops) {
  std::atomic<bool> stop = false;
  const auto feed = MakeReadAheadFeed(FeedOf({0.0, 0.1, 0.2}), [&] { return stop.load(); });
  EXPECT_TRUE(feed->Next());
  stop = true;
  EXPECT_FALSE(feed->Next());
}

TEST(ScanFeedTest, RealtimeKeepsTheNewestScansAndCountsTheOthers) {
  const auto feed = MakeRealtimeFeed(FeedOf(EvenStamps(40, 0.01)), 1.0, [] { return false; });
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::int64_t> scans;
  while (const auto fed = feed->Next()) {
    scans.push_back(fed->scan.index);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_GE(took.count(), 0.39);
  EXPECT_EQ(scans.back(), 39);
  EXPECT_TRUE(std::is_sorted(scans.begin(), scans.end()));
  EXPECT_GT(feed->Counts().dropped, 10);
  EXPECT_EQ(feed->Counts().dropped + static_cast<std::int64_t>(scans.size()), 40);
  EXPECT_GT(feed->Counts().late, 5);
  EXPECT_LE(feed->Counts().late, static_cast<std::int64_t>(scans.size()));
}

TEST(ScanFeedTest, RealtimeScansArriveAtTheTimesOfTheirStampsHoweverLateTheyAreTaken) {
  const auto feed = MakeRealtimeFeed(FeedOf({5.0, 5.01, 5.02, 5.04}), 1.0, [] { return false; });
  std::vector<std::chrono::steady_clock::time_point> arrivals;
  while (const auto fed = feed->Next()) {
    arrivals.push_back(fed->arrival);
    if (arrivals.size() == 1) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  ASSERT_EQ(arrivals.size(), 3u) << "two wait, the second is dropped";
  const auto after_s = [&](std::size_t i) {
    return std::chrono::duration<double>(arrivals[i] - arrivals[0]).count();
  };
  EXPECT_NEAR(after_s(1), 0.02, 1e-6);
  EXPECT_NEAR(after_s(2), 0.04, 1e-6);
  EXPECT_EQ(feed->Counts().late, 2);
  EXPECT_EQ(feed->Counts().dropped, 1);
}

TEST(ScanFeedTest, AFasterRateBringsScansEarlier) {
  const auto feed = MakeRealtimeFeed(FeedOf({5.0, 5.04, 5.1}), 2.0, [] { return false; });
  std::vector<std::chrono::steady_clock::time_point> arrivals;
  while (const auto fed = feed->Next()) arrivals.push_back(fed->arrival);
  ASSERT_EQ(arrivals.size(), 3u);
  EXPECT_NEAR(std::chrono::duration<double>(arrivals[1] - arrivals[0]).count(), 0.02, 1e-6);
  EXPECT_NEAR(std::chrono::duration<double>(arrivals[2] - arrivals[0]).count(), 0.05, 1e-6);
}

TEST(ScanFeedTest, RealtimeCanBeAbandoned) {
  const auto feed = MakeRealtimeFeed(FeedOf({0.0, 1000.0}), 1.0, [] { return false; });
  EXPECT_TRUE(feed->Next());
}

}  // namespace
}  // namespace covsplat
