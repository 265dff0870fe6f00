// SPDX-License-Identifier: Apache-2.0
// The stream of states, over the real sockets.
#include <gtest/gtest.h>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;
using MonitorTest = ControlFixture;

TEST_F(MonitorTest, AcceptsIntervalsOf20To60000Milliseconds) {
  start();
  for (const std::string interval :
       {"19", "60001", "-5", "20.5", "\"200\"", "1e30", "18446744073709551615"}) {
    RawClient client = statusClient();
    client.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":)" + interval +
                R"(},"more":true})");
    EXPECT_EQ(invalidParameter("intervalMs"), client.json()) << interval;
  }
  for (const std::string interval : {"20", "60000", "null"}) {
    RawClient client = statusClient();
    client.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":)" + interval +
                R"(},"more":true})");
    const json first = client.json();
    EXPECT_EQ(true, first["continues"]);
    EXPECT_EQ("idle", first["parameters"]["status"]["mode"]);
    EXPECT_EQ(0, first["parameters"]["droppedCount"]);
    EXPECT_EQ(R"({"ticks":0,"contactTicks":0,"minForceN":null,"maxForceN":null,"maxWakeupLatencyNs":null,
                  "wakeupLatency":null,"computeTime":null})"_json,
              first["parameters"]["window"]);
  }
}

/// Returns the window without its percentiles.
json sums(json window) {
  window.erase("wakeupLatency");
  window.erase("computeTime");
  return window;
}

rt::Tick tickWith(double fx_n, double fy_n, std::uint32_t points, std::int64_t latency_ns) {
  rt::Tick tick;
  tick.command_force_n_in_world = {fx_n, fy_n, 0};
  tick.points_used = points;
  tick.wakeup_latency_ns = latency_ns;
  return tick;
}

/// The next window of the stream with ticks in it.
json nextWindow(RawClient& client) {
  json window = {{"ticks", 0}};
  while (window["ticks"] == 0) window = client.json()["parameters"]["window"];
  return window;
}

TEST_F(MonitorTest, SumsUpTheTicksBetweenTwoRepliesOfEachStream) {
  start();
  RawClient fast = statusClient();
  RawClient slow = statusClient();
  fast.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":20},"more":true})");
  slow.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":60},"more":true})");
  fast.reply();
  slow.reply();
  addTicks({tickWith(3, 4, 12, 7000), tickWith(0.5, 0, 0, 9000), tickWith(0, 1, 1, -20)});
  const json expected =
      R"({"ticks":3,"contactTicks":2,"minForceN":0.5,"maxForceN":5.0,"maxWakeupLatencyNs":9000})"_json;
  EXPECT_EQ(expected, sums(nextWindow(fast)));
  EXPECT_EQ(expected, sums(nextWindow(slow)));
  addTicks({tickWith(0, 2, 0, 1)});
  EXPECT_EQ(R"({"ticks":1,"contactTicks":0,"minForceN":2.0,"maxForceN":2.0,"maxWakeupLatencyNs":1})"_json,
            sums(nextWindow(fast)));
}

TEST_F(MonitorTest, GivesThePercentilesOfTheTicksOfAWindowAndStartsOver) {
  start();
  RawClient client = statusClient();
  client.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":20},"more":true})");
  client.reply();
  // The histogram's buckets are exact below 16 ns.
  std::vector<rt::Tick> ticks;
  for (int i = 0; i < 1000; ++i) {
    rt::Tick tick = tickWith(0, 0, 0, i < 500 ? 3 : i < 990 ? 7 : i < 999 ? 11 : 13);
    tick.compute_ns = 5;
    ticks.push_back(tick);
  }
  addTicks(ticks);
  const json window = nextWindow(client);
  ASSERT_EQ(1000, window["ticks"]);  // all in one period
  EXPECT_EQ(R"({"p50Ns":3,"p99Ns":7,"p999Ns":11,"maxNs":13})"_json, window["wakeupLatency"]);
  EXPECT_EQ(R"({"p50Ns":5,"p99Ns":5,"p999Ns":5,"maxNs":5})"_json, window["computeTime"]);
  addTicks({tickWith(0, 0, 0, 2)});
  EXPECT_EQ(R"({"p50Ns":2,"p99Ns":2,"p999Ns":2,"maxNs":2})"_json, nextWindow(client)["wakeupLatency"]);
}

class MonitorFieldsTest : public ControlFixture {
 protected:
  /// The first reply for these fields.
  json first(const json& fields) {
    RawClient client = statusClient();
    client.call(
        json{{"method", "io.hapticd.Status.Monitor"}, {"parameters", {{"fields", fields}}}, {"more", true}}
            .dump());
    return client.json();
  }
};

TEST_F(MonitorFieldsTest, ShowsTheFieldsAskedForNestedAsInTheWholeStatus) {
  start();
  const json reply = first({"mode", "tick.commandForceNInWorld", "camera.state", "tick.number"});
  EXPECT_EQ(R"({"mode":"idle","tick":{"commandForceNInWorld":{"x":0.0,"y":0.0,"z":0.0},"number":0},
                "camera":{"state":"streaming"}})"_json,
            reply["parameters"]["status"]);
  EXPECT_EQ(0, reply["parameters"]["window"]["ticks"]);
  EXPECT_EQ(true, reply["continues"]);
}

TEST_F(MonitorFieldsTest, ShowsAWholeObjectBesideAFieldOfIt) {
  start();
  EXPECT_EQ(first({"tick.hipMInWorld", "tick.hipMInWorld.x"})["parameters"]["status"],
            first({"tick.hipMInWorld.x", "tick.hipMInWorld"})["parameters"]["status"]);
}

TEST_F(MonitorFieldsTest, ShowsFieldsOfAnObjectThatIsNullAsThatNull) {
  start();
  EXPECT_EQ(
      R"({"handle":{"link":null,"present":true}})"_json,
      first({"handle.link.roundTrip.p50Ns", "handle.link.sent", "handle.present"})["parameters"]["status"]);
  BoxStatus status;
  status.handle.link.emplace();
  status.handle.link->sent = 9;
  box.setStatus(status);
  EXPECT_EQ(R"({"handle":{"link":{"sent":9}}})"_json, first({"handle.link.sent"})["parameters"]["status"]);
}

TEST_F(MonitorFieldsTest, NamesTheFieldThatThereIsNotAndTheNearest) {
  start();
  const json reply = first({"mode", "loop.rateHertz"});
  EXPECT_EQ("io.hapticd.Status.UnknownField", reply["error"]);
  EXPECT_EQ("loop.rateHertz", reply["parameters"]["field"]);
  EXPECT_NE(std::string::npos, reply["parameters"]["reason"].get<std::string>().find("loop.rateHz")) << reply;
  for (const char* path : {"", ".", "mode.", ".mode", "loop..rateHz", "warnings.0", "mode.x"}) {
    EXPECT_EQ("io.hapticd.Status.UnknownField", first({path})["error"]) << path;
  }
}

TEST_F(MonitorFieldsTest, RefusesWhatIsNoListOfPathsAndEndlessLists) {
  start();
  EXPECT_EQ(invalidParameter("fields"), first("mode"));
  EXPECT_EQ(invalidParameter("fields"), first({1}));
  EXPECT_EQ(invalidParameter("fields"), first(std::vector<std::string>(257, "mode")));
  EXPECT_EQ(R"({})"_json, first(json::array())["parameters"]["status"]);
}

TEST_F(MonitorTest, LeavesOutRepliesForASlowReaderCountsThemAndLosesNoTick) {
  BoxStatus status;
  status.warnings = {std::string(200'000, 'w')};  // more than the kernel keeps for a socket of the server
  box.setStatus(status);
  start();
  RawClient client = statusClient();
  client.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":20},"more":true})");
  EXPECT_TRUE(box.waitForStatusCalls(2));
  addTicks({tickWith(0, 2, 0, 1), tickWith(0, 1, 0, 1)});
  EXPECT_TRUE(box.waitForStatusCalls(6));

  const json first = client.json()["parameters"];
  EXPECT_EQ(0, first["droppedCount"]);
  EXPECT_EQ(1, first["status"]["uptimeS"]);  // the fake box counts its calls there
  const json second = client.json()["parameters"];
  const auto dropped = second["droppedCount"].get<int>();
  EXPECT_GE(dropped, 4);
  EXPECT_EQ(2 + dropped, second["status"]["uptimeS"]);  // the newest state, not one that waited
  EXPECT_EQ(2, second["window"]["ticks"]);
  EXPECT_EQ(1, second["window"]["minForceN"]);
}

}  // namespace
}  // namespace hapticd::daemon::test
