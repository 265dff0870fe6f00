// SPDX-License-Identifier: Apache-2.0
// The streams of states, events and ticks, over the real sockets.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "control_fixture.h"
#include "daemon/control/streams/tick_streams.h"
#include "daemon/trace/format/records.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;
using MonitorTest = ControlFixture;

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
  json status = reply["parameters"]["status"];
  EXPECT_GT(status["tick"]["number"], 0);
  status["tick"]["number"] = 0;
  EXPECT_EQ(R"({"mode":"idle","tick":{"commandForceNInWorld":{"x":0.0,"y":0.0,"z":0.0},"number":0},
                "camera":{"state":"streaming"}})"_json,
            status);
  EXPECT_EQ(0, reply["parameters"]["window"]["ticks"]);
  EXPECT_EQ(true, reply["continues"]);
}

TEST_F(MonitorFieldsTest, ShowsAWholeObjectBesideAFieldOfIt) {
  start();
  EXPECT_EQ(first({"leds", "leds.state"})["parameters"]["status"],
            first({"leds.state", "leds"})["parameters"]["status"]);
}

TEST_F(MonitorFieldsTest, ShowsFieldsOfAnObjectThatIsNullAsThatNull) {
  start();
  EXPECT_EQ(
      R"({"handle":{"link":null,"present":true}})"_json,
      first({"handle.link.roundTrip.p50Ns", "handle.link.sent", "handle.present"})["parameters"]["status"]);
  box.amendStatus([](BoxStatus& status) {
    status.handle.link.emplace();
    status.handle.link->sent = 9;
  });
  EXPECT_EQ(R"({"handle":{"link":{"sent":9}}})"_json, first({"handle.link.sent"})["parameters"]["status"]);
}

TEST_F(MonitorTest, LeavesOutRepliesForASlowReaderCountsThemAndLosesNoTick) {
  start();
  box.setNotices({std::string(200'000, 'w')});  // more than the kernel keeps for a socket of the server
  const int before = box.statusCalls();
  RawClient client = statusClient();
  client.call(R"({"method":"io.hapticd.Status.Monitor","parameters":{"intervalMs":20},"more":true})");
  EXPECT_TRUE(box.waitForStatusCalls(before + 2));
  addTicks({tickWith(0, 2, 0, 1), tickWith(0, 1, 0, 1)});
  EXPECT_TRUE(box.waitForStatusCalls(before + 6));

  const json first = client.json()["parameters"];
  EXPECT_EQ(0, first["droppedCount"]);
  const json second = client.json()["parameters"];
  const auto dropped = second["droppedCount"].get<int>();
  EXPECT_GE(dropped, 4);
  const auto uptime_s = [](const json& reply) { return reply["status"]["uptimeS"].get<double>(); };
  // after a late period the next one follows sooner
  EXPECT_GE(uptime_s(second) - uptime_s(first), 0.01 * dropped) << "the newest state, not one that waited";
  EXPECT_EQ(2, second["window"]["ticks"]);
  EXPECT_EQ(1, second["window"]["minForceN"]);
}

// --- events

using config::EventKind;

JournalEntry entryOf(EventKind kind, const std::string& text) {
  return {JournalEntry::Priority::warning, text, kind, {{"DEVICE", "simulated"}}};
}

class EventsTest : public ControlFixture {
 protected:
  RawClient subscribed(const std::string& parameters = "{}") {
    RawClient client = statusClient();
    client.call(R"({"method":"io.hapticd.Status.Events","parameters":)" + parameters + R"(,"more":true})");
    return client;
  }
  void addEvents(EventKind kind, int count) { addEvents(kind, std::string(rt::wordOf(kind)), count); }
  void addEvents(EventKind kind, const std::string& text, int count) {
    for (int i = 0; i < count; ++i) addEvent(entryOf(kind, text + " " + std::to_string(i)));
  }
  /// The next event's text.
  static std::string nextText(RawClient& client) {
    return client.json()["parameters"]["event"]["text"].get<std::string>();
  }
};

TEST_F(EventsTest, ShowsAnEntryOfTheJournalWithItsFieldsInLowerCase) {
  start();
  RawClient client = subscribed();
  addEvent({JournalEntry::Priority::info, "no event", {}, {{"MODE", "idle"}}});
  addEvent(entryOf(EventKind::handle, "handle lost (simulated)"));
  const json reply = client.json();
  EXPECT_EQ(true, reply["continues"]);
  EXPECT_EQ(0, reply["parameters"]["droppedCount"]);
  json event = reply["parameters"]["event"];
  const auto age = std::chrono::system_clock::now().time_since_epoch() -
                   std::chrono::nanoseconds(event["timeNs"].get<std::int64_t>());
  EXPECT_LT(std::chrono::abs(age), std::chrono::hours(1));  // of that clock, not of another
  event.erase("timeNs");
  const json expected = {{"number", 1},
                         {"kind", "handle"},
                         {"text", "handle lost (simulated)"},
                         {"priority", "warning"},
                         {"fields", {{"device", "simulated"}}}};
  EXPECT_EQ(expected, event);
}

TEST_F(EventsTest, BeginsWithThe64NewestInOrderAndGoesOnWithNewOnes) {
  start();
  RawClient newest = subscribed();
  addEvents(EventKind::mode, 100);
  while (nextText(newest) != "mode 99") {
  }
  RawClient all = subscribed();
  EXPECT_EQ("mode 36", nextText(all));
  for (int i = 37; i < 100; ++i) EXPECT_EQ("mode " + std::to_string(i), nextText(all));
  addEvents(EventKind::camera, 1);
  EXPECT_EQ("camera 0", nextText(all));
}

TEST_F(EventsTest, ShowsOnlyTheKindsAskedFor) {
  start();
  RawClient client = subscribed(R"({"kinds":["camera","handle"]})");
  addEvents(EventKind::mode, 3);
  addEvents(EventKind::camera, 1);
  addEvents(EventKind::mode, 1);
  addEvents(EventKind::handle, 1);
  EXPECT_EQ("camera 0", nextText(client));
  const json event = client.json()["parameters"]["event"];
  EXPECT_EQ("handle 0", event["text"]);
  EXPECT_EQ(6, event["number"]);
}

TEST_F(EventsTest, LosesTheOldestForASlowReaderAndCountsThem) {
  start();
  RawClient slow = subscribed();
  RawClient fast = subscribed();
  const std::string padding(4000, 'x');  // a few hundred fill what the kernel keeps
  constexpr int kEvents = 800;
  for (int i = 0; i < kEvents; i += 40) {  // fewer at a time than are kept
    addEvents(EventKind::mode, padding, 40);
    for (int read = 0; read < 40; ++read) nextText(fast);
  }
  int received = 0;
  json last;
  while (last.is_null() || last["event"]["number"] != kEvents) {
    const json reply = slow.json()["parameters"];
    ASSERT_TRUE(reply.is_object());
    ++received;
    // Every event before this one was received or is counted.
    EXPECT_EQ(reply["event"]["number"], received + reply["droppedCount"].get<int>());
    last = reply;
  }
  EXPECT_GT(last["droppedCount"], 0);
  EXPECT_GT(received, 256);  // what waits in the service, beside what waits in the kernel
}

TEST_F(EventsTest, CutsTextsOfAnyLength) {
  start();
  RawClient client = subscribed();
  addEvent({JournalEntry::Priority::error, std::string(500'000, 'a'), EventKind::warning});
  EXPECT_EQ(std::string(4096, 'a'), nextText(client));
}

// --- every tick

class TickStreamsTest : public ControlFixture {
 protected:
  static std::string callWith(const json& parameters) {
    return json{{"method", "io.hapticd.Status.Ticks"}, {"parameters", parameters}, {"more", true}}.dump();
  }
  json refusal(const json& parameters) const {
    RawClient client = statusClient();
    client.call(callWith(parameters));
    return client.json();
  }
  /// A stream whose first reply has come: it gets each tick from now on.
  RawClient streamOf(const json& parameters) const {
    RawClient client = statusClient();
    client.call(callWith(parameters));
    EXPECT_EQ(0, client.json()["parameters"]["count"]);
    return client;
  }
};

std::vector<rt::Tick> ticksFrom(std::uint64_t first, std::uint64_t count) {
  std::vector<rt::Tick> ticks(count);
  for (std::uint64_t i = 0; i < count; ++i) ticks[i].number = first + i;
  return ticks;
}

/// The ticks of a stream that a client has collected up to the number `last`.
struct Collected {
  std::vector<std::uint64_t> numbers;
  std::uint64_t lost = 0;
  std::size_t largest_reply = 0;
};

Collected collectUntil(RawClient& client, std::uint64_t last) {
  Collected collected;
  while (collected.numbers.empty() || collected.numbers.back() < last) {
    const json reply = client.json();
    if (!reply.contains("parameters") || reply.contains("error")) {
      ADD_FAILURE() << reply.dump();
      break;
    }
    const json& parameters = reply["parameters"];
    EXPECT_EQ(true, reply["continues"]);
    EXPECT_EQ(parameters["count"], parameters["ticks"]["number"].size());
    for (const json& number : parameters["ticks"]["number"])
      collected.numbers.push_back(number.get<std::uint64_t>());
    collected.lost = parameters["lostCount"].get<std::uint64_t>();
    collected.largest_reply = std::max(collected.largest_reply, parameters["count"].get<std::size_t>());
  }
  return collected;
}

TEST_F(TickStreamsTest, GiveEveryTickOnceAndInOrder) {
  start();
  RawClient client = streamOf({{"fields", {"number"}}, {"intervalMs", 5}});
  addTicks(ticksFrom(1000, 250));
  addTicks(ticksFrom(1250, 7));
  const Collected collected = collectUntil(client, 1256);
  ASSERT_EQ(collected.numbers.size(), 257U);
  for (std::size_t i = 0; i < collected.numbers.size(); ++i) EXPECT_EQ(collected.numbers[i], 1000 + i);
  EXPECT_EQ(collected.lost, 0U);
  EXPECT_LE(collected.largest_reply, TickStreams::kMaxPerReply);
}

TEST_F(TickStreamsTest, GiveTheFieldsAskedForWithWordsVectorsAndNullForWhatIsNotFinite) {
  start();
  RawClient client =
      streamOf({{"fields", {"mode", "command_force_n_in_world", "blending", "gain", "law", "mode"}},
                {"intervalMs", 5}});
  rt::Tick tick;
  tick.number = 7;
  tick.mode = rt::Mode::engaged;
  tick.law = rt::ForceLaw::surface;
  tick.command_force_n_in_world = {0.5, -1.25, 2};
  tick.blending = true;
  tick.gain = std::numeric_limits<double>::quiet_NaN();
  addTicks({tick});
  EXPECT_EQ(R"({"count":1,"lostCount":0,"ticks":{"mode":["engaged"],
                "command_force_n_in_world":[[0.5,-1.25,2.0]],"blending":[true],"gain":[null],
                "law":["surface"]}})"_json,
            client.json()["parameters"]);
}

// The live view asks for all of them.
TEST_F(TickStreamsTest, TakeEveryFieldOfATickAtOnce) {
  std::vector<std::string> names;
  const rt::Tick tick;
  trace::visitFields(tick, [&names](std::string_view name, const auto&) { names.emplace_back(name); });
  start();
  RawClient client = streamOf({{"fields", names}, {"intervalMs", 5}});
  addTicks(ticksFrom(1, 1));
  addTicks(ticksFrom(2, 1));
  EXPECT_FALSE(collectUntil(client, 2).numbers.empty());
}

TEST_F(TickStreamsTest, GiveTicksAtARateAndThoseInWhichAFieldChanges) {
  start();
  RawClient client = streamOf({{"fields", {"number"}},
                               {"intervalMs", 5},
                               {"rateHz", 250},
                               {"orChanged", {"handle_buttons", "mode"}}});
  std::vector<rt::Tick> ticks = ticksFrom(1000, 400);
  for (rt::Tick& tick : ticks) tick.planned_ns = static_cast<std::int64_t>(tick.number) * 1'000'000;
  ticks[101].handle.buttons = 1;  // for one tick
  ticks[202].mode = rt::Mode::engaged;
  for (std::size_t i = 203; i < ticks.size(); ++i) ticks[i].mode = rt::Mode::engaged;
  addTicks(ticks);
  std::vector<std::uint64_t> expected;
  for (const rt::Tick& tick : ticks) {
    const bool changed = tick.number == 1101 || tick.number == 1102 || tick.number == 1202;
    if (tick.number % 4 == 0 || changed) expected.push_back(tick.number);
  }
  const Collected collected = collectUntil(client, 1396);
  EXPECT_EQ(collected.numbers, expected);
  EXPECT_EQ(collected.lost, 0U);
}

TEST_F(TickStreamsTest, CountTicksThatDidNotReachThem) {
  start();
  RawClient client = streamOf({{"fields", {"number"}}, {"intervalMs", 5}});
  addTicks(ticksFrom(1, 3));
  addTicks(ticksFrom(14, 2));  // 4 to 13 did not come
  EXPECT_EQ(collectUntil(client, 15).lost, 10U);
}

TEST_F(TickStreamsTest, KeepTheNewestTicksForAClientThatIsTooSlowAndCountTheOthers) {
  start();
  RawClient client = streamOf({{"fields", {"number"}}, {"intervalMs", 1000}});
  const std::uint64_t count = TickStreams::kTicksKept + 500;
  addTicks(ticksFrom(1, 1));
  EXPECT_EQ(collectUntil(client, 1).lost, 0U);
  addTicks(ticksFrom(2, count));  // all in one period, which is far shorter than the stream's interval
  const Collected collected = collectUntil(client, count + 1);
  EXPECT_EQ(collected.numbers.size() + collected.lost, count);
  EXPECT_EQ(collected.numbers.size(), TickStreams::kTicksKept);
}

TEST_F(TickStreamsTest, AreLimitedInNumberAndFreeTheirPlaceWhenTheClientLeaves) {
  start();
  std::vector<RawClient> clients;
  for (std::size_t i = 0; i < TickStreams::kMaxStreams; ++i)
    clients.push_back(streamOf({{"fields", {"number"}}}));
  EXPECT_EQ(errorReply("io.hapticd.Status.TooManyStreams", {{"limit", TickStreams::kMaxStreams}}),
            refusal({{"fields", {"number"}}}));
  clients.pop_back();
  for (int attempt = 0; attempt < 1000;
       ++attempt) {  // the server notices within a few turns that it has left
    if (!refusal({{"fields", {"number"}}}).contains("error")) return;
  }
  ADD_FAILURE() << "no place became free";
}

}  // namespace
}  // namespace hapticd::daemon::test
