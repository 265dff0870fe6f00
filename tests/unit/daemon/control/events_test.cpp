// SPDX-License-Identifier: Apache-2.0
// The stream of events, over the real sockets.
#include <gtest/gtest.h>

#include <chrono>

#include "control_fixture.h"

namespace hapticd::daemon::test {
namespace {

using config::EventKind;
using nlohmann::json;

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

TEST_F(EventsTest, ShowsChangesOfClientsWithWhoMadeThem) {
  start();
  askControl("io.hapticd.Control.SetParameters", R"({"parameters":{"force.stiffness_n_per_m":800}})");
  RawClient client = subscribed();
  const json event = client.json()["parameters"]["event"];
  EXPECT_EQ("parameter", event["kind"]);
  EXPECT_EQ("notice", event["priority"]);
  EXPECT_EQ(json({{"parameter", "force.stiffness_n_per_m"},
                  {"old", "500"},
                  {"new", "800"},
                  {"uid", std::to_string(::getuid())},
                  {"pid", std::to_string(::getpid())}}),
            event["fields"]);
  askControl("io.hapticd.Control.Engage");
  EXPECT_EQ("engage", client.json()["parameters"]["event"]["kind"]);
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

TEST_F(EventsTest, RefusesKindsThatAreNone) {
  start();
  for (const char* kinds : {R"("mode")", "[]", "[1]", "{}"}) {
    RawClient client = subscribed(std::string(R"({"kinds":)") + kinds + "}");
    EXPECT_EQ(invalidParameter("kinds"), client.json()) << kinds;
  }
}

TEST_F(EventsTest, RefusesAnUnknownKindAndNamesAllThatThereAre) {
  start();
  RawClient client = subscribed(R"({"kinds":["mode","modes"]})");
  EXPECT_EQ(errorReply("io.hapticd.Status.OutOfRange",
                       {{"parameter", "kinds"},
                        {"allowed",
                         "any of mode, camera, handle, warning, engage, disengage, clear_fault, parameter, "
                         "profile, calibration, trace, mark, configuration, reload, stop, fixture, region, "
                         "breach, frame, force"}}),
            client.json());
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

}  // namespace
}  // namespace hapticd::daemon::test
