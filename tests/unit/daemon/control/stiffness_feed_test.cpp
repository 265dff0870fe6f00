// SPDX-License-Identifier: Apache-2.0
// The limits and means of measured stiffness, with a clock of the test's own.
#include "daemon/control/methods/stiffness_feed.h"

#include <gtest/gtest.h>

#include "daemon/running_box.h"

namespace hapticd::daemon::test {
namespace {

using std::chrono::milliseconds;
using Clock = StiffnessFeed::Clock;

class StiffnessFeedTest : public testing::Test {
 protected:
  StiffnessFeedTest() { box.applyAdditions(regions({region("liver", 0, 300)})); }

  static config::RegionSettings region(const std::string& name, double x_m, double stiffness_n_per_m) {
    config::RegionSettings region;
    region.name = name;
    region.position_m = {x_m, 0, 0};
    region.radius_m = 0.1;
    region.stiffness_n_per_m = stiffness_n_per_m;
    return region;
  }
  static config::SceneAdditions regions(const std::vector<config::RegionSettings>& list) {
    return {{}, list, ""};
  }

  /// The mean of the region after a measurement; 0 where it was refused.
  double mean(double stiffness_n_per_m, double weight = 1, double x_m = 0) {
    const auto taken = feed.take({{x_m, 0, 0}, stiffness_n_per_m, std::nullopt, weight}, now);
    return taken ? taken->stiffness_n_per_m : 0;
  }

  /// How often the feed has changed the map.
  int changes() const { return changes_; }
  void periodic(Clock::time_point time) {
    const std::vector<config::RegionSettings> before = box.additions().regions;
    feed.periodic(time);
    if (box.additions().regions != before) ++changes_;
  }

  RunningBox box{{}};  // no force loop is needed to change its regions
  StiffnessFeed feed{box};
  Clock::time_point now = Clock::time_point() + std::chrono::hours(1);

 private:
  int changes_ = 0;
};

TEST_F(StiffnessFeedTest, BeginsWithTheFirstMeasurementAndAveragesTheOthers) {
  EXPECT_DOUBLE_EQ(500, mean(500));
  EXPECT_DOUBLE_EQ(600, mean(700));
  EXPECT_DOUBLE_EQ(500, mean(300, 1)) << "(500 + 700 + 300) / 3";
}

TEST_F(StiffnessFeedTest, FollowsAChangeBecauseThePastWeighsAtMostFifty) {
  for (int i = 0; i < 100; ++i) mean(400);
  EXPECT_DOUBLE_EQ((50 * 400.0 + 910) / 51, mean(910));
}

TEST_F(StiffnessFeedTest, TakesTwoHundredASecondFromAllAndCountsTheRest) {
  for (int i = 0; i < 250; ++i) mean(400);
  EXPECT_EQ(200U, feed.status().accepted);
  EXPECT_EQ(50U, feed.status().limited);
  now += milliseconds(4);
  EXPECT_EQ(0, mean(400));
  now += milliseconds(1);
  EXPECT_DOUBLE_EQ(400, mean(400)) << "one each 5 ms";
  EXPECT_EQ(0, mean(400));
}

TEST_F(StiffnessFeedTest, CountsMeasurementsThatMissAllRegions) {
  EXPECT_EQ(0, mean(400, 1, 5));
  EXPECT_EQ(1U, feed.status().outside);
  EXPECT_EQ(0U, feed.status().accepted);
}

TEST_F(StiffnessFeedTest, ChangesTheMapAtMostTwentyTimesASecond) {
  for (int i = 0; i < 200; ++i) {
    mean(301 + i);
    periodic(now);
    now += milliseconds(5);
  }
  EXPECT_EQ(20, changes()) << "within one second";
  now += milliseconds(100);
  periodic(now);
  periodic(now + milliseconds(100));
  EXPECT_EQ(21, changes()) << "the last ones, and no change without a measurement";
}

TEST_F(StiffnessFeedTest, BeginsANewMeanWhereSomebodyElseHasChangedTheRegion) {
  mean(500);
  mean(700);
  feed.flush();
  box.applyAdditions(regions({region("liver", 0, 250)}));
  EXPECT_DOUBLE_EQ(900, mean(900));
}

TEST_F(StiffnessFeedTest, GoesOnWhereAnotherRegionIsAdded) {
  mean(500);
  feed.flush();
  auto list = box.additions();
  list.regions.push_back(region("other", 1, 100));
  box.applyAdditions(list);
  EXPECT_DOUBLE_EQ(600, mean(700));
}

TEST_F(StiffnessFeedTest, AveragesDampingOverTheMeasurementsThatHaveIt) {
  mean(500);
  ASSERT_TRUE(feed.take({{}, 500, 2.0, 1}, now));
  ASSERT_TRUE(feed.take({{}, 500, 4.0, 1}, now));
  feed.flush();
  EXPECT_DOUBLE_EQ(3, box.additions().regions.at(0).damping_n_s_per_m);
}

TEST_F(StiffnessFeedTest, MarksTheFirstMeasurementAfterAPause) {
  EXPECT_TRUE(feed.take({{}, 500, std::nullopt, 1}, now)->begins);
  EXPECT_FALSE(feed.take({{}, 500, std::nullopt, 1}, now + milliseconds(9999))->begins);
  EXPECT_TRUE(feed.take({{}, 500, std::nullopt, 1}, now + milliseconds(19999))->begins);
}

}  // namespace
}  // namespace hapticd::daemon::test
