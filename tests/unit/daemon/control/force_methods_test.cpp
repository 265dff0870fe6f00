// SPDX-License-Identifier: Apache-2.0
// Forces of another program as clients feed them, over the real sockets.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

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

}  // namespace
}  // namespace hapticd::daemon::test
