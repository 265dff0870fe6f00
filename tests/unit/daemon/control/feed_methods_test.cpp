// SPDX-License-Identifier: Apache-2.0
// Poses of moving frames and forces as clients feed them, over the real sockets.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "control_fixture.h"
#include "daemon/control/base/rate_limit.h"
#include "daemon/control/methods/methods.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

class FrameMethodsTest : public ControlFixture {
 protected:
  void SetUp() override {
    config::Settings settings = box.settings();
    settings.additions.frames = {{.name = "phantom"}};
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
  json feed(const json& parameters) { return askControl("io.hapticd.Control.FeedPose", parameters.dump()); }
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

TEST_F(FrameMethodsTest, RefusesByNameWhatIsNoPose) {
  const auto invalid = [&](const json& more, const std::string& field) {
    EXPECT_EQ(invalidParameter(field), feed(pose(more))) << more;
  };
  invalid({{"positionM", {0, 0}}}, "positionM");
  invalid({{"positionM", {0, 0, nullptr}}}, "positionM");
  invalid({{"positionM", nullptr}}, "positionM");
  invalid({{"orientationXyzw", {0, 0, 1}}}, "orientationXyzw");
  invalid({{"orientationXyzw", "1"}}, "orientationXyzw");
  invalid({{"velocityMPerS", {0, 0, "fast"}}}, "velocityMPerS");
  invalid({{"timeNs", 1.5}}, "timeNs");
  invalid({{"timeNs", 1}, {"ageS", 0.1}}, "timeNs");
  invalid({{"ageS", 1e9}}, "ageS");
  invalid({{"frame", 3}}, "frame");
  json refused = feed(pose({{"orientationXyzw", {0, 0, 0, 1.2}}}));
  EXPECT_EQ("io.hapticd.Control.PoseRefused", refused["error"]);
  EXPECT_EQ("not_unit", refused["parameters"]["cause"]);
  refused = feed(pose({{"positionM", {0, 0, 11}}}));
  EXPECT_EQ("not_finite", refused["parameters"]["cause"]);
  EXPECT_EQ(1, waitFor("notUnit", 1));
  EXPECT_EQ(1, waitFor("notFinite", 1));
  const json unknown = feed(pose({{"frame", "tool"}}));
  EXPECT_EQ("io.hapticd.Control.UnknownFrame", unknown["error"]);
  EXPECT_EQ(json({"phantom"}), unknown["parameters"]["frames"]);
}

TEST_F(FrameMethodsTest, CountsWhatTheForceLoopDrops) {
  feed(pose());
  feed(pose({{"ageS", 5}}));
  EXPECT_EQ(1, waitFor("older", 1));
  feed(pose({{"ageS", -1}}));
  EXPECT_EQ(1, waitFor("future", 1));
  feed(pose({{"positionM", {3, 0, 0}}}));
  EXPECT_EQ(1, waitFor("jumps", 1));
  EXPECT_EQ(1, frame()["accepted"]);
}

TEST_F(FrameMethodsTest, CannotBeFedOverTheStatusSocket) {
  const json reply = askStatus("io.hapticd.Control.FeedPose", pose().dump());
  EXPECT_TRUE(reply.contains("error")) << reply;
}

class ForceMethodsTest : public ControlFixture {
 protected:
  void SetUp() override {
    allow(1);
    start();
  }
  void allow(double most_n) {
    config::Settings settings = box.settings();
    settings.live.safety.max_external_force_n = most_n;
    box.setSettings(settings);
  }
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
  RawClient client = controlClient();
  double largest_n = 0;
  // A busy machine may look only after the 20 ms for which a force acts.
  for (int i = 0; i < 2000 && largest_n == 0; ++i) {
    ASSERT_FALSE(feedBy(client).contains("error"));
    largest_n = std::max(largest_n, inLoop()["y"].get<double>());
  }
  EXPECT_GT(largest_n, 0);
  EXPECT_LE(largest_n, 0.5);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // more than the 20 ms for which it may act
  for (int i = 0; i < 2000 && inLoop()["y"] != 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(0, inLoop()["y"]);
}

TEST_F(ForceMethodsTest, RefusesByNameWhatIsNoForce) {
  const auto invalid = [&](const json& more, const std::string& field) {
    EXPECT_EQ(invalidParameter(field), feed(more)) << more;
  };
  invalid({{"forceNInWorld", {0, 0}}}, "forceNInWorld");
  invalid({{"forceNInWorld", {0, 0, nullptr}}}, "forceNInWorld");
  invalid({{"forceNInWorld", nullptr}}, "forceNInWorld");
  invalid({{"forceNInWorld", "strong"}}, "forceNInWorld");
  invalid({{"ageS", "old"}}, "ageS");
  invalid({{"timeNs", 0.5}}, "timeNs");
  invalid({{"timeNs", 1}, {"ageS", 0.001}}, "timeNs");
  for (const std::int64_t time_ns : {std::int64_t{0}, rt::monotonicNow_ns() - 20'000'000,
                                     rt::monotonicNow_ns() + rt::kNsPerSecond, INT64_MIN, INT64_MAX})
    EXPECT_EQ("age", feed({{"timeNs", time_ns}})["parameters"]["cause"]) << time_ns;
  for (const double age_s : {0.02, 1.0, -0.001}) {
    const json reply = feed({{"ageS", age_s}});
    EXPECT_EQ("io.hapticd.Control.ForceRefused", reply["error"]) << age_s;
    EXPECT_EQ("age", reply["parameters"]["cause"]) << age_s;
  }
}

TEST_F(ForceMethodsTest, RefusesAllWhereNoneIsAllowed) {
  allow(0);
  const json reply = feed();
  EXPECT_EQ("io.hapticd.Control.ForceRefused", reply["error"]);
  EXPECT_EQ("not_allowed", reply["parameters"]["cause"]);
}

TEST_F(ForceMethodsTest, TakesForcesOfOneConnectionAtATime) {
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
  EXPECT_FALSE(feedBy(second).contains("error"));
}

TEST_F(ForceMethodsTest, CannotBeFedOverTheStatusSocket) {
  const json reply = askStatus("io.hapticd.Control.FeedForce", force().dump());
  EXPECT_TRUE(reply.contains("error")) << reply;
}

TEST(RateLimit, CountsEachSecondAnew) {
  RateLimit limit(3);
  const RateLimit::Clock::time_point begin(std::chrono::seconds(100));
  for (int second = 0; second < 3; ++second) {
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(i < 3,
                limit.allows(begin + std::chrono::seconds(second) + std::chrono::milliseconds(150 * i)));
  }
}

}  // namespace
}  // namespace hapticd::daemon::test
