// The whole system on real recordings; skipped where they are not installed.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "tests/support/data.hpp"
#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/sensor_estimate.hpp"
#include "covsplat/io/scan_source.hpp"
#include "covsplat/slam/slam_system.hpp"

namespace covsplat::test {
namespace {

constexpr int kScans = kSanitized ? 4 : 20;

std::vector<Scan> ReadScans(const std::filesystem::path& folder,
                            double scan_period_s,
                            int max_scans = kScans) {
  const auto source = std::move(
      OpenScanSource(folder, {.max_scans = max_scans, .scan_period_s = scan_period_s}).value());
  std::vector<Scan> scans;
  while (std::optional<Scan> scan = source->Next().value()) scans.push_back(std::move(*scan));
  return scans;
}

std::vector<ScanRecord> Follow(const SlamConfig& config, const std::vector<Scan>& scans) {
  const SensorEstimate sensor = EstimateSensorModel(scans, {});
  const auto system = std::move(SlamSystem::Create(config, sensor.model).value());
  std::vector<ScanRecord> records;
  records.reserve(scans.size());
  for (const Scan& scan : scans) records.push_back(*system->Process(scan));
  system->Finish();
  EXPECT_GT(system->GetMapper().Map().Size(), 1000u);
  return records;
}

/// Scans that were not tracked, the first one left out.
std::int64_t CountLost(const SlamConfig& config, const std::vector<Scan>& scans) {
  return std::ranges::count(Follow(config, scans), TrackState::kLost, &ScanRecord::state);
}

SlamConfig Lockstep() {
  SlamConfig config;
  config.system.schedule = Schedule::kLockstep;
  config.system.threads = 2;
  if (kSanitized) {
    config.mapper.schedule = {
        .steps_new = 1, .steps_near = 1, .steps_old = 1, .steps_per_visit = 1, .final_steps = 0};
  }
  return config;
}

TEST(RecordedSlam, FollowsAHandHeldSolidStateLidar) {
  const auto folder = TestData("hku_1_kf");
  if (!folder) GTEST_SKIP() << kNoTestData;
  const std::vector<Scan> scans = ReadScans(*folder, 0.1);
  ASSERT_EQ(static_cast<int>(scans.size()), kScans);
  EXPECT_EQ(CountLost(Lockstep(), scans), 0);
}

// It sees 70 degrees, often little but one wall: registrations took up to 91 steps.
TEST(RecordedSlam, RegistersASolidStateLidarInFewSteps) {
  const auto folder = TestData("hku_1_kf");
  if (!folder) GTEST_SKIP() << kNoTestData;
  if (kSanitized) GTEST_SKIP() << "takes minutes";
  SlamConfig config = Lockstep();
  config.mapper.feedback.mode = FeedbackMode::kFrozen;
  for (const ScanRecord& record : Follow(config, ReadScans(*folder, 0.1, 115))) {
    EXPECT_LT(record.iterations, 60) << record.scan;
  }
}

TEST(RecordedSlam, FollowsACarWithASpinningLidar) {
  const auto folder = TestData("kitti_raw_0005");
  if (!folder) GTEST_SKIP() << kNoTestData;
  const std::vector<Scan> scans = ReadScans(*folder, 0.1033);
  ASSERT_EQ(static_cast<int>(scans.size()), kScans);
  SlamConfig config = Lockstep();
  config.tracker.deskew.time_source = TimeSource::kAzimuth;
  config.tracker.deskew.scan_period_s = 0.1033;
  EXPECT_EQ(CountLost(config, scans), 0);
}

TEST(RecordedSlam, FollowsACarWithoutTimesOfPoints) {
  const auto folder = TestData("kitti_raw_0005");
  if (!folder) GTEST_SKIP() << kNoTestData;
  EXPECT_EQ(CountLost(Lockstep(), ReadScans(*folder, 0.1033)), 0);
}

}  // namespace
}  // namespace covsplat::test
