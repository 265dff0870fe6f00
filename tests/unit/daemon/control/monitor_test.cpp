// The stream of states, over the real sockets.
#include <gtest/gtest.h>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;
using MonitorTest = ControlFixture;

TEST_F(MonitorTest, ExpectsMoreForAStream) {
  start();
  EXPECT_EQ(errorReply("org.varlink.service.ExpectedMore"), askStatus("io.hapticd.Status.Monitor"));
}

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
    EXPECT_EQ(
        R"({"ticks":0,"contactTicks":0,"minForceN":null,"maxForceN":null,"maxWakeupLatencyNs":null})"_json,
        first["parameters"]["window"]);
  }
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
  EXPECT_EQ(expected, nextWindow(fast));
  EXPECT_EQ(expected, nextWindow(slow));
  addTicks({tickWith(0, 2, 0, 1)});
  EXPECT_EQ(R"({"ticks":1,"contactTicks":0,"minForceN":2.0,"maxForceN":2.0,"maxWakeupLatencyNs":1})"_json,
            nextWindow(fast));
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
