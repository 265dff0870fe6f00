// SPDX-License-Identifier: Apache-2.0
// Poses, forces and measured stiffness as clients feed them.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "config/base/rate_limit.h"
#include "config/settings/driver_rows.h"
#include "control_fixture.h"
#include "daemon/control/methods/methods.h"
#include "daemon/control/methods/stiffness_feed.h"
#include "daemon/running_box.h"
#include "drivers/handle/simulated/simulated_hand.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

class FrameMethodsTest : public ControlFixture {
 protected:
  void SetUp() override {
    config::Settings settings = box.settings();
    // that of the other one lasts longer than any pause of a busy machine
    settings.additions.frames = {{.name = "phantom"}, {.name = "bone", .timeout_s = 10}};
    config::FixtureSettings sphere{.name = "nerve", .kind = rt::FixtureKind::sphere, .frame = "phantom"};
    sphere.radius_m = 0.01;
    settings.additions.fixtures = {sphere};
    box.setSettings(settings);
    start();
  }

  static json pose(const json& more = json::object()) {
    json parameters{{"frame", "phantom"}, {"positionM", {0.1, 0, 0}}, {"orientationXyzw", {0, 0, 0, 1}}};
    parameters.update(more);
    return parameters;
  }
  static json feed(const json& parameters, RawClient& client) {
    client.call(json{{"method", "io.hapticd.Control.FeedPose"}, {"parameters", parameters}}.dump());
    return client.json();
  }
  json feed(const json& parameters) {
    RawClient client = controlClient();
    return feed(parameters, client);
  }
  json frame() { return askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["frames"][0]; }
  json entry() { return askStatus("io.hapticd.Status.ListFrames")["parameters"]["frames"][0]; }
  /// Waits until the status of the frame has this value; the last one otherwise.
  json waitFor(const char* field, const json& value) {
    json last;
    for (int i = 0; i < 2000; ++i) {
      last = frame()[field];
      if (last == value) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return last;
  }
};

TEST_F(FrameMethodsTest, AFrameIsLiveAfterFivePosesAndLostWithoutMore) {
  EXPECT_EQ("none", entry()["state"]);
  EXPECT_TRUE(entry()["positionM"].is_null());
  EXPECT_TRUE(frame()["orientationXyzw"].is_null());
  EXPECT_EQ(json({"nerve"}), entry()["fixtures"]);
  EXPECT_EQ("fade", entry()["definition"]["on_loss"]);
  for (int i = 0; i < 5; ++i) {
    const json reply = feed(pose());
    ASSERT_FALSE(reply.contains("error")) << reply;
    EXPECT_GT(reply["parameters"]["timeNs"], 0);
  }
  EXPECT_EQ(5, waitFor("accepted", 5));
  EXPECT_EQ(json({0, 0, 0, 1}), frame()["orientationXyzw"]);
  EXPECT_EQ(1, waitFor("returns", 1));
  EXPECT_EQ("lost", waitFor("state", "lost"));
  const json lost = entry();
  EXPECT_NEAR(0.1, lost["positionM"][0], 1e-6);
  EXPECT_EQ(json({0.0, 0.0, 0.0, 1.0}), lost["orientationXyzw"]);
}

TEST_F(FrameMethodsTest, SaysAndCountsWhyAPoseIsNotUsed) {
  RawClient client = controlClient();
  feed(pose(), client);
  const auto refused = [&](const json& more, const char* cause, const char* counter) {
    const json reply = feed(pose(more), client);
    EXPECT_EQ("io.hapticd.Control.PoseRefused", reply["error"]);
    EXPECT_EQ(cause, reply["parameters"]["cause"]);
    EXPECT_NE("", reply["parameters"]["reason"]);
    EXPECT_EQ(1, waitFor(counter, 1));
  };
  refused({{"ageS", 5}}, "older", "older");
  refused({{"ageS", -1}}, "future", "future");
  refused({{"positionM", {0, 0, 0}}}, "identity", "identity");
  refused({{"positionM", {3, 0, 0}}}, "jump", "jumps");
  refused({{"orientationXyzw", {0, 0, 0, 1.2}}}, "not_unit", "notUnit");
  refused({{"positionM", {0, 0, 11}}}, "not_finite", "notFinite");
  EXPECT_EQ(1, frame()["accepted"]);
}

TEST_F(FrameMethodsTest, TakesPosesOfTheFirstWhoseAreUsableAndNamesItToOthers) {
  RawClient broken = controlClient(), second = controlClient();
  const auto bone = [](const json& more = json::object()) {
    json parameters = pose(more);
    parameters["frame"] = "bone";
    return parameters;
  };
  {
    RawClient first = controlClient();
    EXPECT_EQ("not_unit", feed(bone({{"orientationXyzw", {0, 0, 0, 0}}}), broken)["parameters"]["cause"]);
    EXPECT_FALSE(feed(bone(), first).contains("error")) << "what is not usable takes no place";
    const json refused = feed(bone({{"positionM", {0.2, 0, 0}}}), second);
    EXPECT_EQ("other_sender", refused["parameters"]["cause"]);
    const std::string reason = refused["parameters"]["reason"];
    EXPECT_TRUE(reason.starts_with(
        fmt::format("another program feeds poses of frame bone: pid {} of uid {} (", ::getpid(), ::getuid())))
        << reason;
    const auto named = [this] {
      const std::vector<std::string> all = warnings();
      return std::ranges::any_of(all, [](const std::string& warning) {
        return warning.starts_with("two programs feed poses of frame bone: pid ");
      });
    };
    for (int i = 0; i < 100'000 && !named(); ++i) feed(bone(), second);
    EXPECT_TRUE(named());
    EXPECT_EQ(0, askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["frames"][1]["jumps"])
        << "the force loop has not seen the other poses";
  }
  json reply;
  for (int i = 0; i < 100'000; ++i) {  // until the box knows that the first one has left
    reply = feed(bone(), second);
    if (!reply.contains("error")) break;
  }
  EXPECT_FALSE(reply.contains("error")) << reply;
}

class ForceMethodsTest : public ControlFixture {
 protected:
  void SetUp() override {
    allow(1);
    start();
  }
  void allow(double most_n, double most_w = 1) {
    config::Settings settings = box.settings();
    settings.live.safety.max_external_force_n = most_n;
    settings.live.safety.max_external_power_w = most_w;
    box.setSettings(settings);
  }
  void engage() { ASSERT_FALSE(askControl("io.hapticd.Control.Engage").contains("error")); }
  static json force(const json& more = json::object()) {
    json parameters{{"forceNInWorld", {0, 0.5, 0}}};
    parameters.update(more);
    return parameters;
  }
  static json feedBy(RawClient& client) {
    client.call(json{{"method", "io.hapticd.Control.FeedForce"}, {"parameters", force()}}.dump());
    return client.json();
  }
  json feed(const json& more = json::object()) {
    return askControl("io.hapticd.Control.FeedForce", force(more).dump());
  }
  json inLoop() {
    return askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["tick"]["externalForceNInWorld"];
  }
};

TEST_F(ForceMethodsTest, AForceReachesTheForceLoopAndEndsWithItsSender) {
  engage();
  RawClient client = controlClient();
  double largest_n = 0;
  // A busy machine may look only after the 20 ms for which a force acts.
  for (int i = 0; i < 2000 && largest_n == 0; ++i) {
    feedBy(client);  // refused while a busy machine makes the box hold
    largest_n = std::max(largest_n, inLoop()["y"].get<double>());
  }
  EXPECT_GT(largest_n, 0);
  EXPECT_LE(largest_n, 0.5);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // more than the 20 ms for which it may act
  for (int i = 0; i < 2000 && inLoop()["y"] != 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(0, inLoop()["y"]);
}

TEST_F(ForceMethodsTest, RefusesWhatIsNotExerted) {
  for (const std::int64_t time_ns :
       {rt::monotonicNow_ns() - 20'000'000, rt::monotonicNow_ns() + rt::kNsPerSecond})
    EXPECT_EQ("age", feed({{"timeNs", time_ns}})["parameters"]["cause"]) << time_ns;
  EXPECT_EQ("not_engaged", feed()["parameters"]["cause"]);
  EXPECT_EQ("not_finite", feed({{"forceNInWorld", {1e308, 1e308, 0}}})["parameters"]["cause"]);
  allow(1, 0);
  EXPECT_EQ("not_allowed", feed()["parameters"]["cause"]);
  allow(0);
  EXPECT_EQ("not_allowed", feed()["parameters"]["cause"]);
}

TEST_F(ForceMethodsTest, TakesForcesOfOneConnectionAtATime) {
  engage();
  RawClient first = controlClient();
  RawClient second = controlClient();
  bool was_refused = false;
  // On a busy machine the first one's turn may have ended before the second one comes.
  for (int i = 0; i < 2000 && !was_refused; ++i) {
    feedBy(first);
    const json reply = feedBy(second);
    was_refused = reply.contains("error") && reply["parameters"]["cause"] == "other_sender";
  }
  EXPECT_TRUE(was_refused);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));  // longer than a turn
  const json reply = feedBy(second);
  EXPECT_FALSE(reply.contains("error") && reply["parameters"]["cause"] == "other_sender") << reply;
}

class HandMethodsTest : public ControlFixture {
 protected:
  void allow(bool follows) {
    config::Settings settings = box.settings();
    settings.handle.of<drivers::SimulatedHandleSettings>().follows_person = follows;
    box.setSettings(settings);
    start();
  }
  static json moveBy(RawClient& client, const json& target) {
    client.call(
        json{{"method", "io.hapticd.Control.MoveHand"}, {"parameters", {{"targetMInWorld", target}}}}.dump());
    return client.json();
  }
  rt::Vec3 hip() {
    const json p = askStatus("io.hapticd.Status.GetStatus")["parameters"]["status"]["tick"]["hipMInWorld"];
    return {p["x"].get<double>(), p["y"].get<double>(), p["z"].get<double>()};
  }
};

TEST_F(HandMethodsTest, LeadsTheHandToItsTarget) {
  allow(true);
  RawClient client = controlClient();
  const rt::Vec3 target{0.1, -0.05, -0.4};
  double distance_m = 1;
  for (int i = 0; i < 20'000 && distance_m > 0.001; ++i) {
    const json reply = moveBy(client, {target.x, target.y, target.z});
    ASSERT_TRUE(!reply.contains("error") || reply["error"] == "io.hapticd.Control.FeedLimited") << reply;
    distance_m = norm(hip() - target);
  }
  EXPECT_LE(distance_m, 0.001);
  const std::vector<JournalEntry> entries = log();
  EXPECT_EQ(1, std::ranges::count_if(entries, [](const JournalEntry& entry) {
              return entry.text.ends_with("leads the simulated hand");
            }));
}

TEST_F(HandMethodsTest, CutsAFarTargetToTheWorkspace) {
  config::Settings settings = box.settings();
  settings.live.safety.workspace_radius_m = 0.6;
  box.setSettings(settings);
  allow(true);
  RawClient client = controlClient();
  for (int i = 0; i < 20'000 && hip().x < 0.599; ++i) {
    moveBy(client, {1e100, 0, 0});
    ASSERT_LE(norm(hip()), 0.6 + 1e-9);
  }
  EXPECT_NEAR(hip().x, 0.6, 0.001);
}

TEST_F(HandMethodsTest, RefusesWhereTheHandFollowsNoPersonAndWhatIsNoPlace) {
  allow(false);
  RawClient client = controlClient();
  const json reply = moveBy(client, {0, 0, -0.5});
  EXPECT_EQ("io.hapticd.Control.HandRefused", reply["error"]);
  EXPECT_EQ("not_allowed", reply["parameters"]["cause"]);
  EXPECT_EQ(
      "the handle simulated follows no person (only a simulated one does, started with "
      "simulated_handle.follows_person)",
      reply["parameters"]["reason"]);
  EXPECT_EQ(invalidParameter("targetMInWorld"), moveBy(client, {0, 0}));
  EXPECT_EQ(invalidParameter("targetMInWorld"), moveBy(client, {0, nullptr, 0}));
}

TEST_F(HandMethodsTest, RefusesWithAnotherHandleWhateverTheSimulatedOneMay) {
  config::Settings settings = box.settings();
  settings.handle.of<drivers::SimulatedHandleSettings>().follows_person = true;
  for (const config::HandleDriver& driver : config::handleDrivers()) {
    settings.handle.driver = driver.word;
    EXPECT_EQ(driver.word == "simulated", driver.follows_person(settings.handle)) << driver.word;
  }
}

TEST_F(HandMethodsTest, IsLedByOneConnectionAtATime) {
  allow(true);
  RawClient second = controlClient();
  {
    RawClient first = controlClient();
    EXPECT_EQ("not_finite", moveBy(second, {1e308, 1e308, 1e308})["parameters"]["cause"]);
    bool was_refused = false;
    // on a busy machine the turn of the first one may have ended before the second one comes
    for (int i = 0; i < 100 && !was_refused; ++i) {
      ASSERT_FALSE(moveBy(first, {0, 0, -0.5}).contains("error"));
      const json reply = moveBy(second, {0, 0, -0.4});
      was_refused = reply.contains("error") && reply["parameters"]["cause"] == "other_sender";
      if (!was_refused) std::this_thread::sleep_for(std::chrono::milliseconds(2100));  // its own turn ends
    }
    EXPECT_TRUE(was_refused);
  }
  json reply;
  for (int i = 0; i < 100'000; ++i) {  // until the box knows that the first one has left
    reply = moveBy(second, {0, 0, -0.5});
    if (!reply.contains("error")) break;
  }
  EXPECT_FALSE(reply.contains("error")) << reply;
}

TEST(RateLimit, DropsTheSurplusEvenlyAndSaysHowMuchComes) {
  using std::chrono::microseconds;
  base::RateLimit::Clock::time_point now(std::chrono::seconds(100));
  base::RateLimit limit(500);
  EXPECT_EQ(0, limit.excess(now));
  int taken = 0, gap = 0, longest = 0;
  for (int i = 0; i < 10'000; ++i, now += microseconds(1000)) {
    const bool is_taken = limit.allows(now);
    taken += is_taken ? 1 : 0;
    gap = is_taken ? 0 : gap + 1;
    longest = std::max(longest, gap);
  }
  EXPECT_EQ(1, longest) << "every second one";
  EXPECT_NEAR(500 + 5000, taken, 1) << "those of the second before, too";
  EXPECT_NEAR(1000, limit.excess(now), 1);
  for (int i = 0; i < 1500; ++i, now += microseconds(2000)) EXPECT_TRUE(limit.allows(now)) << i;
  EXPECT_EQ(0, limit.excess(now)) << "none of the newest second was dropped";
}

// The limits and means of measured stiffness, with a clock of the test's own.

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
