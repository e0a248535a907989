#include "covsplat/mapping/training_views.hpp"

#include <utility>

#include "tests/support/mapping_fixtures.hpp"
#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

class TrainingViewsTest : public ::testing::Test {
 protected:
  TrainingViewsTest()
      : map_(std::move(MakeSplatEngine(Backend::kCpu, ReducedSensor(), {}, pool_).value()), pool_) {
  }

  /// One keyframe every so many metres along x.
  void Drive(TrainingViews& views, int keyframes, double step_m) {
    for (int k = 0; k < keyframes; ++k) {
      const SE3 pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(step_m * k, 0.0, 0.0));
      views.Add(map_.AddKeyframe(SphereKeyframe(pose, 10.0f), {}));
    }
  }

  static constexpr std::size_t kPixels = 32 * 512;
  ThreadPool pool_{1};
  GaussianMap map_;
};

TEST_F(TrainingViewsTest, KeepsNoMoreThanItsMemoryAndTheWholeWay) {
  ScheduleConfig config;
  config.max_views_mb = 20.5 * 5 * kPixels / 1e6;  // 20 views
  TrainingViews views(map_, kPixels, config);
  Drive(views, 100, 2.0);
  const std::vector<int> kept = views.Keyframes();
  EXPECT_EQ(kept.size(), 20u);
  EXPECT_LE(static_cast<double>(views.Bytes()), 1e6 * config.max_views_mb);
  EXPECT_EQ(kept.front(), 0);
  EXPECT_EQ(kept.back(), 99);
  EXPECT_EQ(kept[13], 93) << "the newest are all there";
  for (std::size_t i = 1; i < kept.size(); ++i) EXPECT_LE(kept[i] - kept[i - 1], 20) << i;
  EXPECT_EQ(views.Training().size(), 100u);
}

TEST_F(TrainingViewsTest, TheNewestAreNeediest) {
  TrainingViews views(map_, kPixels, {});
  Drive(views, 3, 2.0);
  EXPECT_EQ(views.Neediest(), 0) << "of none anything is known";
  for (int k = 0; k < 3; ++k) views.Trained(k, k == 2 ? 10 : 100, 0.5);
  EXPECT_EQ(views.Neediest(), 2);
  views.Trained(2, 100, 0.5);
  EXPECT_NE(views.Neediest(), 2);
}

TEST_F(TrainingViewsTest, StepsGoToAllAndMostToWhatIsExplainedWorst) {
  const double losses[] = {0.1, 0.4, 0.2, 0.1};
  ScheduleConfig config;
  config.max_steps_per_view = 0;
  TrainingViews views(map_, kPixels, config);
  Drive(views, 4, 2.0);
  for (int visit = 0; visit < 800; ++visit) {
    const int keyframe = views.Neediest().value();
    views.Trained(keyframe, 1, losses[keyframe]);
  }
  for (int k = 0; k < 4; ++k) {
    const auto steps = static_cast<double>(views.Training()[static_cast<std::size_t>(k)].steps);
    EXPECT_NEAR(steps, 1000.0 * losses[k], 40.0) << k;
  }
}

TEST_F(TrainingViewsTest, RestsWhenAllHaveHadEnough) {
  ScheduleConfig config;
  config.max_steps_per_view = 30;
  TrainingViews views(map_, kPixels, config);
  EXPECT_FALSE(views.Neediest());
  Drive(views, 3, 2.0);
  int visits = 0;
  for (; views.Neediest() && visits < 100; ++visits) views.Trained(*views.Neediest(), 10, 0.5);
  EXPECT_EQ(visits, 9);
  for (const KeyframeTraining& training : views.Training()) EXPECT_EQ(training.steps, 30);
  Drive(views, 1, 2.0);
  EXPECT_EQ(views.Neediest(), 3) << "a new one has had none";
}

TEST_F(TrainingViewsTest, RemembersWhatWasDoneByViewsThatItForgot) {
  TrainingViews views(map_, kPixels, {});
  Drive(views, 2, 2.0);
  views.Trained(0, 7, 0.3);
  views.Trained(0, 2, 0.2);
  views.ForgetAll();
  EXPECT_TRUE(views.Empty());
  EXPECT_EQ(views.Bytes(), 0u);
  EXPECT_EQ(views.Training()[0].steps, 9);
  EXPECT_EQ(views.Training()[0].loss, 0.2);
  EXPECT_EQ(views.Training()[1].steps, 0);
}

}  // namespace
}  // namespace covsplat::test
