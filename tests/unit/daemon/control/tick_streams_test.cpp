// SPDX-License-Identifier: Apache-2.0
// The streams of every tick, over the real sockets.
#include <gtest/gtest.h>

#include <algorithm>
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

TEST_F(TickStreamsTest, RefuseWhatTheyDoNotTakeAndNameWhatTheyDo) {
  start();
  const auto outOfRange = [](const char* parameter, const char* allowed) {
    return errorReply("io.hapticd.Status.OutOfRange", {{"parameter", parameter}, {"allowed", allowed}});
  };
  for (const json& value : {json(4), json(1001), json(-5)})
    EXPECT_EQ(outOfRange("intervalMs", "5..1000 ms"),
              refusal({{"fields", {"number"}}, {"intervalMs", value}}));
  for (const json& value : {json(20.5), json("50"), json(true)})
    EXPECT_EQ(invalidParameter("intervalMs"), refusal({{"fields", {"number"}}, {"intervalMs", value}}));
  for (const json& value :
       {json::array(), json(std::vector<std::string>(TickStreams::kMaxFields + 1, "number"))})
    EXPECT_EQ(outOfRange("fields", "1..80 names"), refusal({{"fields", value}}));
  for (const json& value : {json(0), json(1001)})
    EXPECT_EQ(outOfRange("rateHz", "1..1000"), refusal({{"fields", {"number"}}, {"rateHz", value}}));
  EXPECT_EQ(invalidParameter("rateHz"), refusal({{"fields", {"number"}}, {"rateHz", 2.5}}));
  EXPECT_EQ(outOfRange("orChanged", "at most 16 names"),
            refusal({{"fields", {"number"}}, {"orChanged", std::vector<std::string>(17, "number")}}));
  EXPECT_EQ("io.hapticd.Status.UnknownField",
            refusal({{"fields", {"number"}}, {"orChanged", {"nmber"}}})["error"]);
  for (const json& value : {json(nullptr), json("number"), json({1})})
    EXPECT_EQ(invalidParameter("fields"), refusal({{"fields", value}}));
  const json unknown = refusal({{"fields", {"number", "comand_force_n_in_world"}}});
  EXPECT_EQ("io.hapticd.Status.UnknownField", unknown["error"]);
  EXPECT_NE(std::string::npos,
            unknown["parameters"]["reason"].get<std::string>().find("command_force_n_in_world"));
  EXPECT_EQ(errorReply("org.varlink.service.ExpectedMore"), askStatus("io.hapticd.Status.Ticks"));
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
